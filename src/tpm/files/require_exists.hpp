#pragma once
#include <filesystem>

namespace tpm::files {

/// Throws Error(bad_input) "no such file" if nothing has the name: what every command says of a
/// file that is not there, also where something else than read_file() would open it.
void require_exists(const std::filesystem::path& path);

}  // namespace tpm::files
