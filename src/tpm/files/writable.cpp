#include "tpm/files/writable.hpp"

#include "tpm/files/file.hpp"

namespace tpm::files {

void require_writable_folder(const std::filesystem::path& folder) {
  const std::filesystem::path trial = folder / ".tpm-trial";
  write_file(trial, "can a result be written here?\n");
  std::filesystem::remove(trial);
}

}  // namespace tpm::files
