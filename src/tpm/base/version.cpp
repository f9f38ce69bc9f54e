#include "tpmkit/version.hpp"

namespace tpm {

std::string_view version() noexcept {
  return TPM_VERSION;
}

}  // namespace tpm
