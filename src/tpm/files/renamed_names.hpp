#pragma once
#include <span>
#include <string_view>

#include "tpm/files/json.hpp"

namespace tpm::files {

/// A key, or a word that stands as a value, of an input file that has a new name. docs/library.md
/// says for how long the former name is read.
struct RenamedName {
  enum class Kind { key, value };
  std::string_view schema;  ///< the kind of file: "scene" for schemas/scene.schema.json
  std::string_view place;   ///< pointer to the object or list that it stands in; * is any member
  Kind kind;
  std::string_view former, current;
  std::string_view until;       ///< the version that no longer reads the former name
  std::string_view formulas{};  ///< pointer to formulas that use the value as a variable
};

/// All that are still read under the former name.
[[nodiscard]] std::span<const RenamedName> renamed_names();

/// Whether the user is told of former names: not of those in a file that tpm wrote, which nobody
/// edits.
enum class FormerNames { told, silent };

/// The document with the current name wherever a former one stands, also in a scene within it.
/// Warns once of each. Throws Error(bad_input) naming both if the current name stands beside it.
[[nodiscard]] Json with_current_names(Json document, std::string_view schema,
                                      std::string_view where,
                                      FormerNames former = FormerNames::told);

/// with_current_names() and check_schema(): how every file that users write is read. The answer is
/// without "$schema", which is for editors and would mean another file where the answer is written.
[[nodiscard]] Json checked(Json document, std::string_view schema, std::string_view where);

}  // namespace tpm::files
