#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <ranges>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace tpm::base {

/// The results of `value`, a member or a function, for the items.
template <class Made, class Items, class Value>
std::vector<Made> mapped(Items&& items, Value value) {
  std::vector<Made> all;
  if constexpr (std::ranges::sized_range<Items>) all.reserve(std::ranges::size(items));
  for (auto&& item : items) all.emplace_back(std::invoke(value, item));
  return all;
}

/// "a, b, c": the text of each item, which `text` says, a member or a function.
template <class Items, class Text>
std::string listed(const Items& items, Text text, std::string_view between = ", ") {
  return fmt::format("{}", fmt::join(mapped<std::string>(items, text), between));
}

/// The distinct results of `value`, a member or a function, for the items, in the order in which
/// they first occur.
template <class Items, class Value>
auto each_once(const Items& items, Value value) {
  std::vector<std::decay_t<decltype(std::invoke(value, *items.begin()))>> all;
  for (const auto& item : items) {
    auto found = std::invoke(value, item);
    if (std::ranges::find(all, found) == all.end()) all.push_back(std::move(found));
  }
  return all;
}

}  // namespace tpm::base
