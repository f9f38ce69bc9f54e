#pragma once
#include <filesystem>

namespace tpm {

/// Writes behind the end of a file a check sum of all before it, and passes the file to the disk:
/// from here on it survives the machine. HDF5 passes over what stands
/// behind its own end; its library can crash on a damaged file, so that such a file is to be found
/// before it is opened. Throws Error(environment).
void seal_file(const std::filesystem::path& file);

/// Throws Error(bad_input) if a file has a seal that is not that of its content. A file without
/// one, or that is not there, passes.
void require_whole(const std::filesystem::path& file);

}  // namespace tpm
