#pragma once
// The one declaration of the keys of an object in a file: name, member, type, sentence. The reader,
// its messages, the writer, the JSON schema and the page of keys follow from it.
//
//     const Block<Bonds>& bonds_block() {
//       static const Block<Bonds> block("bonds", "which spheres are joined", {
//           key("support", &Bonds::support, number({.least = 1, .most = 4, .above = true}),
//               "neighbours are within this many spacings"),
//       });
//       return block;
//     }
//     Bonds bonds = bonds_block().read(json, place);
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tpm/files/keys/types.hpp"
#include "tpmkit/error.hpp"

namespace tpm::files {

/// A key of an object that becomes a T.
template <class T>
struct Key {
  KeyForm form;
  std::function<void(T&, const Json&, const DocumentPlace&)> read;
  std::function<Json(const T&)> write;  ///< null: nothing to say
};

template <class M>
inline constexpr bool kIsOptional = false;
template <class V>
inline constexpr bool kIsOptional<std::optional<V>> = true;

// clang-tidy 14 does not see in a template that a parameter is moved into a designated initializer.
// NOLINTBEGIN(performance-unnecessary-value-param)

/// Declares a key. The value of a default-constructed T is the default, unless the member is
/// optional.
template <class T, class M, class V>
[[nodiscard]] Key<T> key(std::string name, M T::*member, const ValueType<V>& type,
                         std::string sentence) {
  Key<T> declared{
      {.name = std::move(name), .form = type.form, .sentence = std::move(sentence)},
      [member, read = type.read](T& into, const Json& value, const DocumentPlace& place) {
        into.*member = read(value, place);
      },
      {}};
  const auto write_value = type.write;
  if constexpr (kIsOptional<M>) {
    declared.write = [member, write_value](const T& from) {
      return from.*member ? write_value(*(from.*member)) : Json();
    };
  } else {
    declared.write = [member, write_value](const T& from) { return write_value(from.*member); };
    using FT = Form::Type;
    const FT of = type.form->type;
    if (of != FT::block && of != FT::kinds && of != FT::list && of != FT::map && of != FT::any &&
        of != FT::text) {
      declared.form.usual = write_value(T{}.*member);
    }
  }
  return declared;
}

/// The same, and it must be there.
template <class T>
[[nodiscard]] Key<T> required(Key<T> key) {
  key.form.required = true;
  key.form.usual = nullptr;
  return key;
}

/// The same with the default that its reader takes, as files write it.
template <class T>
[[nodiscard]] Key<T> with_default(Key<T> key, Json usual) {
  key.form.usual = std::move(usual);
  return key;
}

/// The same key of a structure that has a T as a member.
template <class Whole, class T>
[[nodiscard]] Key<Whole> within(T Whole::*part, const Key<T>& key) {
  return {key.form,
          [part, read = key.read](Whole& into, const Json& value, const DocumentPlace& place) {
            read(into.*part, value, place);
          },
          [part, write = key.write](const Whole& from) { return write(from.*part); }};
}

/// The same with a value for examples.
template <class T>
[[nodiscard]] Key<T> with_example(Key<T> key, Json example) {
  key.form.example = std::move(example);
  return key;
}

// NOLINTEND(performance-unnecessary-value-param)

/// A violation of a rule about several keys.
struct Fault {
  std::string key;   ///< where in the block: "direction"; empty: the block
  std::string what;  ///< the violation there
};

/// A rule: what is expected, in words that end the message, and its first fault.
template <class T>
struct Rule {
  std::string expected;
  std::function<std::optional<Fault>(const T&)> fault;
};

template <class T>
void require_rules(const std::vector<Rule<T>>& rules, const T& value, const DocumentPlace& place) {
  for (const Rule<T>& rule : rules) {
    if (const auto fault = rule.fault(value)) {
      throw bad_input((fault->key.empty() ? place : place.key(fault->key)).where, fault->what,
                      rule.expected);
    }
  }
}

template <class T>
void read_keys(const std::vector<Key<T>>& keys, const Json& object, const DocumentPlace& place,
               T& into) {
  for (const Key<T>& key : keys) {
    const auto found = object.find(key.form.name);
    if (found != object.end()) key.read(into, *found, place.key(key.form.name));
  }
}

template <class T>
void write_keys(const std::vector<Key<T>>& keys, const T& from, Json& object) {
  for (const Key<T>& key : keys) {
    Json value = key.write(from);
    if (value.is_null() || (!key.form.required && value == key.form.usual)) continue;
    // An empty list where one of a few is asked for: nothing was said.
    if (!key.form.required && value.is_array() && value.size() < key.form.form->fewest) continue;
    object[key.form.name] = std::move(value);
  }
}

/// An object with the same keys always, which becomes a T.
template <class T>
class Block {
 public:
  Block(std::string name, std::string sentence, std::vector<Key<T>> keys,
        std::vector<Rule<T>> rules = {})
      : keys_(std::move(keys)), rules_(std::move(rules)) {
    Form form{.type = Form::Type::block, .name = std::move(name), .sentence = std::move(sentence)};
    for (const Key<T>& key : keys_) form.keys.push_back(key.form);
    for (const Rule<T>& rule : rules_) form.rules.push_back(rule.expected);
    form_ = shared(std::move(form));
  }

  [[nodiscard]] const FormPtr& form() const { return form_; }
  [[nodiscard]] const std::vector<Key<T>>& keys() const { return keys_; }

  /// Throws Error(bad_input), at the key, for what has not the form or breaks a rule.
  [[nodiscard]] T read(const Json& value, const DocumentPlace& place,
                       Numbers numbers = Numbers::texts_alone) const {
    require_form(value, *form_, place, numbers);
    return made(value, place);
  }

  /// Of a value that has the form.
  [[nodiscard]] T made(const Json& value, const DocumentPlace& place) const {
    T into{};
    read_keys(keys_, value, place, into);
    require_rules(rules_, into, place);
    return into;
  }

  /// Without what is as usual.
  [[nodiscard]] Json write(const T& from) const {
    Json object = Json::object();
    write_keys(keys_, from, object);
    return object;
  }

  /// As the type of a key of another block. The block must outlive it.
  [[nodiscard]] ValueType<T> type() const {
    return {form_,
            [this](const Json& value, const DocumentPlace& place) { return made(value, place); },
            [this](const T& from) { return write(from); }};
  }

 private:
  std::vector<Key<T>> keys_;
  std::vector<Rule<T>> rules_;
  FormPtr form_;
};

/// One of the kinds that an object may be of, with the value of the member that says which.
template <class T, class E>
struct Kind {
  E meaning;
  std::string word, sentence;
  std::vector<Key<T>> keys;
};

/// An object whose other keys follow from its kind, which becomes a T. A kind that the object
/// needs not name is that of a default-constructed T.
template <class T, class E>
class Kinds {
 public:
  struct Names {
    std::string name, sentence;
    std::string by = "kind";  ///< the key that tells the kinds apart
    bool may_be_missing = false;
  };

  Kinds(Names names, E T::*member, std::vector<Kind<T, E>> kinds, std::vector<Rule<T>> rules = {})
      : member_(member), kinds_(std::move(kinds)), rules_(std::move(rules)) {
    Form form{.type = Form::Type::kinds, .name = names.name, .sentence = names.sentence};
    form.by = names.by;
    for (const Kind<T, E>& kind : kinds_) {
      KindForm entry{kind.word, kind.sentence, {}};
      for (const Key<T>& key : kind.keys) entry.keys.push_back(key.form);
      form.kinds.push_back(std::move(entry));
      if (names.may_be_missing && kind.meaning == T{}.*member) form.usual_kind = kind.word;
    }
    for (const Rule<T>& rule : rules_) form.rules.push_back(rule.expected);
    form_ = shared(std::move(form));
  }

  [[nodiscard]] const FormPtr& form() const { return form_; }

  [[nodiscard]] const std::vector<Key<T>>& keys(const E& meaning) const {
    return std::find_if(kinds_.begin(), kinds_.end(),
                        [&](const Kind<T, E>& kind) { return kind.meaning == meaning; })
        ->keys;
  }

  /// Throws Error(bad_input), at the key, for what has not the form or breaks a rule.
  [[nodiscard]] T read(const Json& value, const DocumentPlace& place,
                       Numbers numbers = Numbers::texts_alone) const {
    require_form(value, *form_, place, numbers);
    return made(value, place);
  }

  /// Of a value that has the form.
  [[nodiscard]] T made(const Json& value, const DocumentPlace& place) const {
    const KindForm& of = kind_of(value, *form_);
    const auto kind = std::find_if(kinds_.begin(), kinds_.end(),
                                   [&](const Kind<T, E>& k) { return k.word == of.word; });
    T into{};
    into.*member_ = kind->meaning;
    read_keys(kind->keys, value, place, into);
    require_rules(rules_, into, place);
    return into;
  }

  [[nodiscard]] Json write(const T& from) const {
    const auto kind = std::find_if(kinds_.begin(), kinds_.end(),
                                   [&](const Kind<T, E>& k) { return k.meaning == from.*member_; });
    Json object{{form_->by, kind->word}};
    write_keys(kind->keys, from, object);
    return object;
  }

  /// As the type of a key of a block. This must outlive it.
  [[nodiscard]] ValueType<T> type() const {
    return {form_,
            [this](const Json& value, const DocumentPlace& place) { return made(value, place); },
            [this](const T& from) { return write(from); }};
  }

 private:
  E T::*member_;
  std::vector<Kind<T, E>> kinds_;
  std::vector<Rule<T>> rules_;
  FormPtr form_;
};

}  // namespace tpm::files
