#include "tpm/files/keys/form.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <stdexcept>

#include "tpm/base/lists.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/nearest_word.hpp"
#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {
namespace {

using Type = Form::Type;

const KeyForm* find_key(const std::vector<KeyForm>& keys, std::string_view name) {
  const auto found = std::find_if(keys.begin(), keys.end(),
                                  [name](const KeyForm& key) { return key.name == name; });
  return found == keys.end() ? nullptr : &*found;
}

std::vector<std::string> names_of(const std::vector<KeyForm>& keys) {
  return mapped<std::string>(keys, &KeyForm::name);
}

/// A value as a message repeats it.
std::string shown(const Json& value) {
  return value.is_structured() ? std::string(value.type_name()) : printable(value.dump());
}

/// Values of a form in words: "a length above 0 m, such as \"4 mm\"".
std::string expected_words(const Form& form) {
  const auto with_range = [&](std::string_view noun) {
    const std::string range = form.range.words();
    return fmt::format("{}{}{}", noun, range.empty() ? "" : ", ", range);
  };
  switch (form.type) {
    case Type::any:
      return form.sentence.empty() ? "a value" : form.sentence;
    case Type::flag:
      return "true or false";
    case Type::whole:
      return with_range("a whole number");
    case Type::number:
      return with_range("a number");
    case Type::quantity:
      return fmt::format("a text of a number and a unit of {}: {}", dimension_name(form.dimension),
                         units_of(form.dimension));
    case Type::text:
      if (!form.pattern.empty()) return form.sentence;
      return form.fewest > 0 ? "a text that is not empty" : "a text";
    case Type::word:
      return fmt::format("one of {}", fmt::join(form.words, ", "));
    case Type::list:
      return fmt::format("a list{}{}",
                         form.one_too ? ", or one, of: " : " of: ", expected_words(*form.item));
    case Type::map:
    case Type::block:
    case Type::kinds:
      return "an object";
    case Type::either:
      return listed(
          form.forms, [](const FormPtr& one) { return expected_words(*one); }, ", or ");
    case Type::later:
      return expected_words(*form.made());
  }
  return {};
}

[[noreturn]] void refuse_type(const Json& value, const Form& form, const DocumentPlace& place) {
  throw bad_input(place.where, fmt::format("is of the wrong type: {}", shown(value)),
                  expected_words(form));
}

void require_range(double value, const Form& form, const DocumentPlace& place) {
  const std::string_view unit =
      form.type == Type::quantity ? si_symbol(form.dimension) : std::string_view{};
  if (std::isfinite(value) && form.range.holds(value)) return;
  throw bad_input(place.where,
                  fmt::format("{}{}{}", shortest(value), unit.empty() ? "" : " ", unit),
                  form.range.words(unit));
}

bool is_whole(const Json& value) {
  constexpr double kLargest = 9007199254740992.0;  // 2^53: doubles beyond are not exact
  if (!value.is_number_float()) return value.is_number_integer();
  const auto number = value.get<double>();
  return std::abs(number) <= kLargest && number == std::round(number);
}

void require_known(const Json& object, const std::vector<KeyForm>& keys,
                   const DocumentPlace& place) {
  for (const auto& item : object.items()) {
    if (find_key(keys, item.key()) != nullptr) continue;
    const std::vector<std::string> known = names_of(keys);
    throw bad_input(
        place.key(item.key()).where, "unknown key" + did_you_mean(item.key(), known),
        known.empty() ? "no such key" : fmt::format("one of {}", fmt::join(known, ", ")));
  }
}

/// Missing key in words: its sentence and its values.
std::string missing_words(const KeyForm& key) {
  const std::string form = expected_words(*key.form);
  return key.sentence.empty() ? form : fmt::format("{}: {}", key.sentence, form);
}

void require_keys(const Json& object, const std::vector<KeyForm>& keys, const DocumentPlace& place,
                  Numbers numbers) {
  for (const KeyForm& key : keys) {
    if (!key.required || object.contains(key.name)) continue;
    throw bad_input(place.key(key.name).where, "is missing", missing_words(key));
  }
  for (const auto& item : object.items()) {
    if (const KeyForm* key = find_key(keys, item.key())) {
      require_form(item.value(), *key->form, place.key(printable(item.key())), numbers);
    }
  }
}

/// The keys of all kinds, each once.
std::vector<std::string> all_keys(const Form& form) {
  std::vector<std::string> all;
  if (!form.by.empty()) all.push_back(form.by);
  for (const KindForm& kind : form.kinds) {
    for (const KeyForm& key : kind.keys) {
      if (std::find(all.begin(), all.end(), key.name) == all.end()) all.push_back(key.name);
    }
  }
  return all;
}

std::string kinds_with(const Form& form, std::string_view key) {
  std::vector<std::string> words;
  for (const KindForm& kind : form.kinds) {
    if (find_key(kind.keys, key) != nullptr) words.push_back(kind.word);
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

/// Throws for a key that no kind has.
void require_known_to_one(const Json& object, const Form& form, const DocumentPlace& place) {
  const std::vector<std::string> known = all_keys(form);
  for (const auto& item : object.items()) {
    if (std::find(known.begin(), known.end(), item.key()) != known.end()) continue;
    throw bad_input(place.key(item.key()).where, "unknown key" + did_you_mean(item.key(), known),
                    fmt::format("one of {}", fmt::join(known, ", ")));
  }
}

void require_kind_named(const Json& object, const Form& form, const DocumentPlace& place) {
  const std::vector<std::string> words = mapped<std::string>(form.kinds, &KindForm::word);
  const std::string expected = fmt::format("one of {}", fmt::join(words, ", "));
  if (form.by.empty()) {
    const auto there = [&](const std::string& word) { return object.contains(word); };
    if (std::any_of(words.begin(), words.end(), there)) return;
    require_known_to_one(object, form, place);
    throw bad_input(place.where, "has no key that says what it is", expected);
  }
  if (!object.contains(form.by)) {
    if (!form.usual_kind.empty()) return;
    require_known_to_one(object, form, place);
    throw bad_input(place.key(form.by).where, "is missing", expected);
  }
  const Json& kind = object.at(form.by);
  const DocumentPlace at = place.key(form.by);
  if (!kind.is_string()) {
    throw bad_input(at.where, fmt::format("is of the wrong type: {}", shown(kind)), expected);
  }
  const auto word = kind.get<std::string>();
  const std::string& noun = form.by == "kind" && !form.name.empty() ? form.name : form.by;
  if (std::find(words.begin(), words.end(), word) != words.end()) return;
  throw bad_input(
      at.where, fmt::format("unknown {} '{}'{}", noun, printable(word), did_you_mean(word, words)),
      expected);
}

void require_kinds(const Json& object, const Form& form, const DocumentPlace& place,
                   Numbers numbers) {
  if (!object.is_object()) refuse_type(object, form, place);
  require_kind_named(object, form, place);
  const KindForm& kind = kind_of(object, form);
  const std::vector<std::string> known = names_of(kind.keys);
  for (const auto& item : object.items()) {
    const std::string& key = item.key();
    if (key == form.by || find_key(kind.keys, key) != nullptr) continue;
    const std::string others = kinds_with(form, key);
    throw bad_input(
        place.key(key).where,
        others.empty()    ? "unknown key" + did_you_mean(key, known)
        : form.by.empty() ? fmt::format("stands beside '{}'", kind.word)
                          : fmt::format("is no key of the {} '{}'", form.by, kind.word),
        fmt::format("{}{}{}",
                    known.empty() ? fmt::format("no key but {}", form.by)
                                  : fmt::format("one of {}", fmt::join(known, ", ")),
                    others.empty() ? "" : fmt::format("; {} goes with ", printable(key)), others));
  }
  require_keys(object, kind.keys, place, numbers);
}

void require_list(const Json& value, const Form& form, const DocumentPlace& place,
                  Numbers numbers) {
  if (!value.is_array()) {
    if (!form.one_too) refuse_type(value, form, place);
    return require_form(value, *form.item, place, numbers);
  }
  if (value.size() < form.fewest || value.size() > form.most) {
    const auto count = [](std::size_t n) { return fmt::format("{} item{}", n, n == 1 ? "" : "s"); };
    constexpr auto kNoEnd = std::numeric_limits<std::size_t>::max();
    throw bad_input(place.where, fmt::format("a list of {}", count(value.size())),
                    form.fewest == form.most ? count(form.fewest)
                    : form.most == kNoEnd    ? count(form.fewest) + " or more"
                                          : fmt::format("{} to {}", form.fewest, count(form.most)));
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    require_form(value[i], *form.item, place.key(std::to_string(i)), numbers);
  }
  if (form.not_all_zero &&
      std::all_of(value.begin(), value.end(), [](const Json& item) { return item == 0; })) {
    throw bad_input(place.where, "has no length", "a direction: numbers that are not all 0");
  }
  if (!form.distinct) return;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const auto before = value.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(value.begin(), before, value[i]) == before) continue;
    throw bad_input(place.key(std::to_string(i)).where,
                    fmt::format("{} stands twice", shown(value[i])), "each item once");
  }
}

/// True if a value is one of a form's words or of its JSON type: which of several its writer meant.
bool looks_like(const Json& value, const Form& form) {
  switch (form.type) {
    case Type::any:
      return true;
    case Type::flag:
      return value.is_boolean();
    case Type::whole:
    case Type::number:
      return value.is_number();
    case Type::quantity:
      return value.is_string() || (form.plain_too && value.is_number());
    case Type::text:
      return value.is_string();
    case Type::word:
      return value.is_string() && std::find(form.words.begin(), form.words.end(),
                                            value.get<std::string>()) != form.words.end();
    case Type::list:
      return value.is_array() || (form.one_too && looks_like(value, *form.item));
    case Type::map:
    case Type::block:
    case Type::kinds:
      return value.is_object();
    case Type::either:
      return std::any_of(form.forms.begin(), form.forms.end(),
                         [&](const FormPtr& one) { return looks_like(value, *one); });
    case Type::later:
      return looks_like(value, *form.made());
  }
  return false;
}

void require_either(const Json& value, const Form& form, const DocumentPlace& place,
                    Numbers numbers) {
  const auto found = std::find_if(form.forms.begin(), form.forms.end(),
                                  [&](const FormPtr& one) { return looks_like(value, *one); });
  const auto words = std::find_if(form.forms.begin(), form.forms.end(),
                                  [](const FormPtr& one) { return one->type == Type::word; });
  if (found == form.forms.end() && value.is_string() && words != form.forms.end()) {
    return require_form(value, **words, place, numbers);  // says which word was meant
  }
  if (found == form.forms.end()) refuse_type(value, form, place);
  require_form(value, **found, place, numbers);
}

void require_quantity(const Json& value, const Form& form, const DocumentPlace& place,
                      Numbers numbers) {
  const bool plain = form.plain_too || numbers == Numbers::also_si;
  if (!value.is_string() && !(plain && value.is_number())) refuse_type(value, form, place);
  require_range(quantity_of(value, form.dimension, place.where), form, place);
}

void require_word(const Json& value, const Form& form, const DocumentPlace& place) {
  if (!value.is_string()) refuse_type(value, form, place);
  const auto word = value.get<std::string>();
  if (std::find(form.words.begin(), form.words.end(), word) != form.words.end()) return;
  throw bad_input(
      place.where,
      fmt::format("unknown word '{}'{}", printable(word), did_you_mean(word, form.words)),
      expected_words(form));
}

/// The library's matcher calls itself for each character.
constexpr std::size_t kLongestMatched = 4096;

void require_text(const Json& value, const Form& form, const DocumentPlace& place) {
  if (!value.is_string()) refuse_type(value, form, place);
  const auto& text = value.get_ref<const std::string&>();
  if (text.size() < form.fewest) throw bad_input(place.where, "is empty", expected_words(form));
  if (form.pattern.empty()) return;
  const bool fits =
      text.size() <= kLongestMatched && std::regex_search(text, std::regex(form.pattern));
  if (!fits) throw bad_input(place.where, fmt::format("'{}'", printable(text)), form.sentence);
}

}  // namespace

std::string Range::words(std::string_view unit) const {
  const std::string behind = unit.empty() ? "" : fmt::format(" {}", unit);
  const bool lower = std::isfinite(least), upper = std::isfinite(most);
  const auto text = [](double value) {
    constexpr double kWhole = 9007199254740992.0;
    return value == std::round(value) && std::abs(value) < kWhole
               ? fmt::format("{}", static_cast<std::int64_t>(value))
               : shortest(value);
  };
  if (lower && upper) {
    return above ? fmt::format("above {}, at most {}{}", text(least), text(most), behind)
                 : fmt::format("{} to {}{}", text(least), text(most), behind);
  }
  if (lower)
    return above ? fmt::format("above {}{}", text(least), behind)
                 : fmt::format("{}{} or more", text(least), behind);
  if (upper) return fmt::format("at most {}{}", text(most), behind);
  return {};
}

const KindForm& kind_of(const Json& object, const Form& kinds) {
  if (kinds.by.empty()) {
    const auto found =
        std::find_if(kinds.kinds.begin(), kinds.kinds.end(),
                     [&](const KindForm& kind) { return object.contains(kind.word); });
    if (found == kinds.kinds.end()) throw std::logic_error("of no kind");
    return *found;
  }
  const std::string word = object.value(kinds.by, kinds.usual_kind);
  const auto found = std::find_if(kinds.kinds.begin(), kinds.kinds.end(),
                                  [&](const KindForm& kind) { return kind.word == word; });
  if (found == kinds.kinds.end()) throw std::logic_error("no such kind: " + word);
  return *found;
}

Form with_open_keys(Form form) {
  for (KeyForm& key : form.keys) key.required = false;
  for (KindForm& kind : form.kinds) {
    for (KeyForm& key : kind.keys) key.required = false;
  }
  return form;
}

void require_form(const Json& value, const Form& form, const DocumentPlace& place,
                  Numbers numbers) {
  if (form.null_too && value.is_null()) return;
  switch (form.type) {
    case Type::any:
      return;
    case Type::flag:
      if (!value.is_boolean()) refuse_type(value, form, place);
      return;
    case Type::whole:
      if (!is_whole(value)) refuse_type(value, form, place);
      return require_range(value.get<double>(), form, place);
    case Type::number:
      if (!value.is_number()) refuse_type(value, form, place);
      return require_range(value.get<double>(), form, place);
    case Type::quantity:
      return require_quantity(value, form, place, numbers);
    case Type::text:
      return require_text(value, form, place);
    case Type::word:
      return require_word(value, form, place);
    case Type::list:
      return require_list(value, form, place, numbers);
    case Type::map:
      if (!value.is_object()) refuse_type(value, form, place);
      if (value.size() < form.fewest) throw bad_input(place.where, "is empty", "at least one key");
      for (const auto& item : value.items()) {
        require_form(item.value(), *form.item, place.key(printable(item.key())), numbers);
      }
      return;
    case Type::block:
      if (!value.is_object()) refuse_type(value, form, place);
      if (!form.others_too) require_known(value, form.keys, place);
      return require_keys(value, form.keys, place, numbers);
    case Type::kinds:
      return require_kinds(value, form, place, numbers);
    case Type::either:
      return require_either(value, form, place, numbers);
    case Type::later:
      return require_form(value, *form.made(), place, numbers);
  }
}

}  // namespace tpm::files
