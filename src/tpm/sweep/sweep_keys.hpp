#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/file_kind.hpp"

namespace tpm::sweep {

/// Keys of a sweep's file. Its parts are read where they are used.
[[nodiscard]] const FileKind& sweep_kind();

}  // namespace tpm::sweep
