#pragma once
#include <filesystem>

namespace tpm::files {

/// Before long work, not after it: writes a file into the folder, made if it is missing, and
/// removes it again. Throws Error(environment) as write_file does.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace tpm::files
