#pragma once
// Types of values made of others, and texts with a form.
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tpm/files/keys/block.hpp"

namespace tpm::files {

/// A value with a form, as it stands in the file: its reader knows more later.
[[nodiscard]] inline ValueType<Json> as_json(FormPtr form) {
  return {std::move(form), [](const Json& value, const DocumentPlace&) { return value; },
          [](const Json& value) { return value; }};
}

/// A unit such as "kPa"; empty or left out: of plain numbers.
[[nodiscard]] ValueType<Unit> unit_text();

/// {"code", "text"}.
[[nodiscard]] ValueType<Remark> remark();

/// A text that is not written where it is empty.
[[nodiscard]] ValueType<std::string> text_if_any();

/// One of a few texts, empty in memory and not written where there is none.
[[nodiscard]] ValueType<std::string> one_of(std::vector<std::string> words);

/// A text that a regular expression matches.
/// @param what it is, for messages: "a name of letters, digits and _"
/// @param example one that it matches
[[nodiscard]] ValueType<std::string> text_like(std::string pattern, std::string what,
                                               std::string example);

/// A type whose values become others.
/// @param to makes them, of a value and its place; throws Error(bad_input)
/// @param from makes the value again
template <class To, class From, class Make, class Unmake>
[[nodiscard]] ValueType<To> converted(const ValueType<From>& type, Make to, Unmake from) {
  return {type.form,
          [read = type.read, to](const Json& value, const DocumentPlace& place) {
            return To(to(read(value, place), place));
          },
          [write = type.write, from](const To& value) { return write(from(value)); }};
}

/// A key that files may have and nobody reads, such as a quotation.
template <class T>
// NOLINTNEXTLINE(performance-unnecessary-value-param): moved; clang-tidy 14 does not see it
[[nodiscard]] Key<T> unread(std::string name, FormPtr form, std::string sentence) {
  return {{.name = std::move(name), .form = std::move(form), .sentence = std::move(sentence)},
          [](T&, const Json&, const DocumentPlace&) {},
          [](const T&) { return Json(); }};
}

// Forms without members: of what is kept as it stands in the file, for a reader that comes later.

[[nodiscard]] KeyForm optional_key(std::string name, FormPtr form, std::string sentence);
[[nodiscard]] KeyForm required_key(std::string name, FormPtr form, std::string sentence);
[[nodiscard]] FormPtr list_form(FormPtr item, std::size_t fewest,
                                std::size_t most = std::numeric_limits<std::size_t>::max());
[[nodiscard]] FormPtr map_form(FormPtr item, std::size_t fewest = 0);
[[nodiscard]] FormPtr either_form(std::vector<FormPtr> forms);

/// The same form, but null may stand there.
[[nodiscard]] FormPtr or_null(const FormPtr& form);
/// The same object, but other keys may stand in it.
[[nodiscard]] FormPtr with_others(const FormPtr& object);

/// The form of an object that is kept as it stands in the file.
[[nodiscard]] FormPtr object_form(std::string name, std::string sentence,
                                  std::vector<KeyForm> keys);

}  // namespace tpm::files
