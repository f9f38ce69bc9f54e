#pragma once
#include <string_view>

#include "tpm/files/json.hpp"

namespace tpm::files {

/// Throws Error(bad_input), naming what the document is and the command that reads it, if its keys
/// are those of another kind of file than the one wanted.
/// @param kind the name of a schema: "scene" for schemas/scene.schema.json
void require_not_other_kind(const Json& document, std::string_view kind, std::string_view where);

}  // namespace tpm::files
