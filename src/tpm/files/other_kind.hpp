#pragma once
#include <filesystem>
#include <optional>
#include <string_view>

#include "tpm/files/json.hpp"

namespace tpm::files {

/// Throws Error(bad_input), naming what the document is and the command that reads it, if its keys
/// are those of another kind of file than the one wanted.
/// @param kind the name of a schema: "scene" for schemas/scene.schema.json
void require_not_other_kind(const Json& document, std::string_view kind, std::string_view where);

/// Kind of a file that holds no JSON, by its first bytes: "a table of samples", "a web page"; none
/// for JSON, also if it is damaged, and for bytes that no kind is known by.
[[nodiscard]] std::optional<std::string_view> kind_without_json(std::string_view bytes);

/// read_json of a file of one kind. A folder, a table or another document in its place is named
/// with what to type instead: Error(bad_input).
/// @param kind as in require_not_other_kind
[[nodiscard]] Json read_json_of(const std::filesystem::path& path, std::string_view kind);

}  // namespace tpm::files
