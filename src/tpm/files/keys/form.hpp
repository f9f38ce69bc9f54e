#pragma once
// Permitted contents of a file, as data. Readers, messages, JSON schemas and the page of keys come
// from it; block.hpp binds it to the members of structures.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "tpm/files/document_place.hpp"
#include "tpm/files/json.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {

struct Form;
using FormPtr = std::shared_ptr<const Form>;

/// The values that a number may have, in SI.
struct Range {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool above = false;  ///< `least` itself is excluded

  [[nodiscard]] bool holds(double value) const {
    return (above ? value > least : value >= least) && value <= most;
  }
  /// "above 0, at most 1 m", "1 to 3"; empty if every number is held.
  [[nodiscard]] std::string words(std::string_view unit = {}) const;
};

/// A key of an object.
struct KeyForm {
  std::string name;
  FormPtr form;
  std::string sentence;  ///< its meaning, without a full stop
  bool required = false;
  Json usual = nullptr;    ///< the default as files write it; null: none, or one that depends
  Json example = nullptr;  ///< a value for examples, where that of the form does not fit
};

/// One of the kinds that an object may be of.
struct KindForm {
  std::string word;      ///< value of the key that tells them apart
  std::string sentence;  ///< its meaning; may be empty
  std::vector<KeyForm> keys;
};

/// Values that a file may hold in one place. The members that count depend on the type.
struct Form {
  enum class Type {
    any,       ///< whatever JSON has; its reader says more
    flag,      ///< true or false
    whole,     ///< a whole number in `range`; 71.0 is one
    number,    ///< a number in `range`
    quantity,  ///< a text of a number and a unit of `dimension`, in `range`
    text,      ///< a text of at least `fewest` bytes, which `pattern` matches
    word,      ///< one of `words`
    list,      ///< `fewest` to `most` of `item`
    map,       ///< an object with `fewest` or more keys of any names, each an `item`
    block,     ///< an object with `keys`
    kinds,     ///< an object of one of `kinds`, which the key `by` names
    either,    ///< one of `forms`
    later,     ///< returned by `made` when it is asked for: of a list that the program links
  };
  Type type = Type::any;
  std::string name = {};      ///< of a form that several places share: "contact"
  std::string sentence = {};  ///< its meaning
  Range range = {};
  Dimension dimension = Dimension::dimensionless;
  bool plain_too = false;  ///< a quantity may be a number, in SI
  std::vector<std::string> words = {};
  std::size_t fewest = 0, most = std::numeric_limits<std::size_t>::max();
  bool one_too = false;       ///< of a list: one item may stand without brackets
  bool distinct = false;      ///< of a list: no item twice
  bool not_all_zero = false;  ///< of a list of numbers
  FormPtr item = nullptr;
  std::vector<KeyForm> keys = {};
  std::string by = "kind";  ///< empty: each kind has a key of its own, its word, that others lack
  std::string usual_kind =
      {};  ///< the kind of an object without the key `by`; empty: it must be there
  std::vector<KindForm> kinds = {};
  std::vector<FormPtr> forms = {};
  std::function<FormPtr()> made = {};
  /// Rules about several keys, which a JSON schema does not say: a refusal ends with them.
  std::vector<std::string> rules = {};
  Json example = nullptr;
  bool null_too = false;     ///< null may stand there: programs write it where there is nothing
  bool others_too = false;   ///< of a block: it may have keys that nobody reads
  std::string pattern = {};  ///< of a text: a regular expression; `sentence` says what it is
};

/// Numbers in place of quantities are SI: programs put them into documents that they fill in.
enum class Numbers { texts_alone, also_si };

/// Throws Error(bad_input), at the first key that is wrong, unless a value has a form: keys that
/// are unknown or missing, wrong types, words and ranges. Rules are their readers'.
void require_form(const Json& value, const Form& form, const DocumentPlace& place,
                  Numbers numbers = Numbers::texts_alone);

/// The kind of an object, which has the form. Throws std::logic_error for another.
[[nodiscard]] const KindForm& kind_of(const Json& object, const Form& kinds);

/// A form in which every key of objects may be missing, at the first level.
[[nodiscard]] Form with_open_keys(Form form);

}  // namespace tpm::files
