#pragma once
// Values that keep their place in the file, for messages of whoever knows later what is allowed
// there; and keys of objects whose members belong to the structure around them.
#include <string>
#include <utility>

#include "tpm/files/keys/more_types.hpp"

namespace tpm::files {

/// A value and where it stands.
template <class V>
struct Placed {
  V value{};
  DocumentPlace place;
};

template <class V>
[[nodiscard]] ValueType<Placed<V>> placed(const ValueType<V>& type) {
  return converted<Placed<V>>(
      type,
      [](V value, const DocumentPlace& place) {
        return Placed<V>{std::move(value), place};
      },
      [](const Placed<V>& from) { return from.value; });
}

/// The same of a structure that has a member for its place.
template <class T>
[[nodiscard]] ValueType<T> placed(const ValueType<T>& type, DocumentPlace T::*member) {
  return converted<T>(
      type,
      [member](T value, const DocumentPlace& place) {
        value.*member = place;
        return value;
      },
      [](const T& from) { return from; });
}

/// A text of a number and a unit whose dimension the model or the data tell.
struct StatedQuantity {
  std::string text;
  DocumentPlace place;

  /// SI. Throws Error(bad_input) for what is no quantity of the dimension.
  [[nodiscard]] double in(Dimension dimension) const;
  /// The unit as the file states it, for display. Throws as in() does.
  [[nodiscard]] Unit unit(Dimension dimension) const;
};

[[nodiscard]] ValueType<StatedQuantity> stated_quantity();

/// An object in the file whose keys are members of the structure around it.
/// @param block outlives the key
template <class T>
// NOLINTNEXTLINE(performance-unnecessary-value-param): moved; clang-tidy 14 does not see it
[[nodiscard]] Key<T> members(std::string name, const Block<T>& block, std::string sentence) {
  return {{.name = std::move(name), .form = block.form(), .sentence = std::move(sentence)},
          [&block](T& into, const Json& value, const DocumentPlace& place) {
            read_keys(block.keys(), value, place, into);
          },
          [&block](const T& from) { return block.write(from); }};
}

}  // namespace tpm::files
