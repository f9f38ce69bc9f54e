#pragma once
#include "tpm/base/namespaces.hpp"
#include "tpm/files/keys/file_kind.hpp"

namespace tpm::fit {

/// Keys of the configuration of a fit. Its parts are read where they are used
/// (config_parts.hpp).
[[nodiscard]] const FileKind& fit_kind();

/// The same with tables in place of parameters, fixed values and data.
[[nodiscard]] const FileKind& fit_tables_kind();

}  // namespace tpm::fit
