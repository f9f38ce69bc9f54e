#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "tpm/base/lists.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpmkit/error.hpp"

namespace tpm::base {

/// An entry of a table of the words that files and options use for the values of an enumeration.
/// Tables may have richer entries, with members of these names.
template <typename Enum>
struct Word {
  Enum meaning;
  std::string_view text;
};

/// The entry of a value that the table is known to hold.
template <typename Words, typename Enum>
constexpr const auto& entry_of(const Words& words, Enum meaning) noexcept {
  return *std::find_if(words.begin(), words.end(),
                       [meaning](const auto& word) { return word.meaning == meaning; });
}

/// The text of a value, or another where the table does not hold it.
template <typename Words, typename Enum>
constexpr std::string_view word_for(const Words& words, Enum meaning,
                                    std::string_view otherwise = "") noexcept {
  for (const auto& word : words) {
    if (word.meaning == meaning) return word.text;
  }
  return otherwise;
}

/// The entry with this text, or null.
template <typename Words>
constexpr auto find_entry(const Words& words, std::string_view text) noexcept {
  const auto found = std::find_if(words.begin(), words.end(),
                                  [text](const auto& word) { return word.text == text; });
  return found == words.end() ? nullptr : &*found;
}

/// "a, b, c"
template <typename Words>
std::string listed(const Words& words) {
  return listed(words, [](const auto& word) { return word.text; });
}

/// The value that a text stands for. Throws Error(bad_input) that names the nearest and all.
/// @param noun what is named, for the message
/// @param where for the message
template <typename Words>
auto parse_word(const Words& words, std::string_view noun, std::string_view text,
                std::string_view where) {
  if (const auto* entry = find_entry(words, text)) return entry->meaning;
  const auto known = mapped<std::string>(words, [](const auto& word) { return word.text; });
  throw unknown_word(where, fmt::format("unknown {}", noun), text, known);
}

}  // namespace tpm::base
