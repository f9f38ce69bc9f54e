#pragma once
#include <concepts>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/json.hpp"
#include "tpmkit/units.hpp"

namespace tpm::files {

/// A place in a document, for messages: "FILE", or "FILE: key /a/b" below a key.
struct DocumentPlace {
  DocumentPlace() = default;
  /// The whole document.
  /// @param file its name, or another one; not the `where` of a place below a key
  template <std::convertible_to<std::string_view> Text>
  DocumentPlace(const Text& file) : where(std::string_view(file)) {}
  [[nodiscard]] DocumentPlace key(std::string_view name) const;

  std::string where;
  bool below_key = false;
};

/// A text of a number and a unit, SI; or a number, which is SI already: schemas let files say texts
/// alone, programs put numbers there. Throws Error(bad_input).
[[nodiscard]] double quantity_of(const Json& value, Dimension dimension, std::string_view where);

/// The same of what stands under a key. Throws Error(bad_input) with the key.
[[nodiscard]] double quantity_at(const Json& object, std::string_view key, Dimension dimension,
                                 const DocumentPlace& place);

}  // namespace tpm::files
