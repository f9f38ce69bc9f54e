#pragma once
// Types of values in files: a form with what it becomes in memory.
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/form.hpp"

namespace tpm::files {

/// A form, and the value that stands for what has it.
template <class V>
struct ValueType {
  FormPtr form;
  std::function<V(const Json&, const DocumentPlace&)> read;  ///< of what has the form
  std::function<Json(const V&)> write;

  /// The same with a name under which schemas and pages show it once, and what it is.
  [[nodiscard]] ValueType named(std::string name, std::string sentence) const {
    Form renamed = *form;
    renamed.name = std::move(name);
    renamed.sentence = std::move(sentence);
    return {std::make_shared<const Form>(std::move(renamed)), read, write};
  }
};

[[nodiscard]] inline FormPtr shared(Form form) {
  return std::make_shared<const Form>(std::move(form));
}

/// Every number above 0.
inline constexpr Range kAboveZero{.least = 0.0, .above = true};
inline constexpr Range kZeroOrMore{.least = 0.0};
inline constexpr Range kAnyNumber{};

[[nodiscard]] ValueType<bool> flag();
[[nodiscard]] ValueType<std::string> text(std::size_t fewest = 0);
[[nodiscard]] ValueType<double> number(Range range = {});
/// SI in memory, "4 mm" in files.
[[nodiscard]] ValueType<double> quantity(Dimension dimension, Range range = {});
/// One that may be a number in SI, too, such as "0.3" and 0.3.
[[nodiscard]] ValueType<double> plain_quantity(Dimension dimension, Range range = {});
/// Whatever JSON has, for what another reader reads.
[[nodiscard]] ValueType<Json> any(std::string sentence);

template <class N>
[[nodiscard]] ValueType<N> whole(double least, double most) {
  return {shared({.type = Form::Type::whole, .range = {.least = least, .most = most}}),
          [](const Json& value, const DocumentPlace&) { return value.get<N>(); },
          [](const N& value) { return Json(value); }};
}

/// A word of a table such as enum_names.hpp describes.
template <class Words>
[[nodiscard]] auto word(const Words& table) {
  using E = std::decay_t<decltype(table.begin()->meaning)>;
  Form form{.type = Form::Type::word};
  std::vector<std::pair<E, std::string>> words;
  for (const auto& entry : table) {
    form.words.emplace_back(entry.text);
    words.emplace_back(entry.meaning, entry.text);
  }
  return ValueType<E>{shared(std::move(form)),
                      [words](const Json& value, const DocumentPlace&) {
                        const auto text = value.get<std::string>();
                        return std::find_if(words.begin(), words.end(),
                                            [&](const auto& w) { return w.second == text; })
                            ->first;
                      },
                      [words](const E& value) {
                        return Json(std::find_if(words.begin(), words.end(), [&](const auto& w) {
                                      return w.first == value;
                                    })->second);
                      }};
}

struct Length {
  std::size_t fewest = 0, most = std::numeric_limits<std::size_t>::max();
  bool one_too = false, distinct = false;
};

/// A list; with `one_too` one item may stand without brackets.
template <class V>
[[nodiscard]] ValueType<std::vector<V>> list(const ValueType<V>& item, Length length = {}) {
  return {shared({.type = Form::Type::list,
                  .fewest = length.fewest,
                  .most = length.most,
                  .one_too = length.one_too,
                  .distinct = length.distinct,
                  .item = item.form}),
          [read = item.read](const Json& value, const DocumentPlace& place) {
            std::vector<V> items;
            if (!value.is_array()) return std::vector<V>{read(value, place)};
            items.reserve(value.size());
            for (const Json& one : value) {
              items.push_back(read(one, place.key(std::to_string(items.size()))));
            }
            return items;
          },
          [write = item.write](const std::vector<V>& items) { return array_json(items, write); }};
}

/// An object whose keys are names that its author chooses, in the order of the file.
template <class V>
[[nodiscard]] ValueType<std::vector<std::pair<std::string, V>>> map_of(const ValueType<V>& item,
                                                                       std::size_t fewest = 0) {
  using Pairs = std::vector<std::pair<std::string, V>>;
  return {shared({.type = Form::Type::map, .fewest = fewest, .item = item.form}),
          [read = item.read](const Json& value, const DocumentPlace& place) {
            Pairs pairs;
            for (const auto& one : value.items()) {
              pairs.emplace_back(one.key(), read(one.value(), place.key(one.key())));
            }
            return pairs;
          },
          [write = item.write](const Pairs& pairs) {
            Json object = Json::object();
            for (const auto& [name, value] : pairs) object[name] = write(value);
            return object;
          }};
}

/// Three values, such as a place or a direction.
template <class V>
[[nodiscard]] ValueType<std::array<V, 3>> three(const ValueType<V>& item) {
  return {shared({.type = Form::Type::list, .fewest = 3, .most = 3, .item = item.form}),
          [read = item.read](const Json& value, const DocumentPlace& place) {
            return std::array<V, 3>{read(value[0], place.key("0")), read(value[1], place.key("1")),
                                    read(value[2], place.key("2"))};
          },
          [write = item.write](const std::array<V, 3>& items) { return array_json(items, write); }};
}

/// A direction; its length does not count.
[[nodiscard]] ValueType<std::array<double, 3>> direction();

}  // namespace tpm::files
