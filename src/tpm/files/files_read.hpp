#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace tpm::files {

/// The regular files that were read since a FileRoles lives, by name and each once; without those
/// that were written before and those in which a command keeps its state. Empty without a
/// FileRoles.
[[nodiscard]] std::vector<std::filesystem::path> files_read();

/// SHA-256 of a file's bytes in lower-case hexadecimal; empty if it cannot be read. Of the content
/// at the time of the call; the file is not held in memory, and reading it is not noted.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace tpm::files
