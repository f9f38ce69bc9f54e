#pragma once
#include <string>
#include <string_view>

#include "tpm/core/units.hpp"
#include "tpm/store/json.hpp"

namespace tpm {

/// A place in a document, for messages: "FILE: key /a/b".
struct DocumentPlace {
  std::string where;
  [[nodiscard]] DocumentPlace key(std::string_view name) const;
};

/// The value with its unit that stands under a key, SI. Throws Error(bad_input) with the key.
/// @param object of which the schema has said that the key stands for a text
[[nodiscard]] double quantity_at(const Json& object, std::string_view key, Dimension dimension,
                                 const DocumentPlace& place);
/// The same; throws too unless it is above 0.
[[nodiscard]] double positive_at(const Json& object, std::string_view key, Dimension dimension,
                                 const DocumentPlace& place);

}  // namespace tpm
