#include "tpm/files/require_exists.hpp"

#include "tpmkit/error.hpp"

namespace tpm::files {

void require_exists(const std::filesystem::path& path) {
  std::error_code ec;
  if (!std::filesystem::exists(std::filesystem::status(path, ec))) {
    throw bad_input(path.string(), "no such file", "a readable file");
  }
}

}  // namespace tpm::files
