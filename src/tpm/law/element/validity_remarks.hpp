#pragma once
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"

namespace tpm::law {

/// Limits of the paper's element that a contact passes, as validity_flags says them.
[[nodiscard]] std::vector<Remark> validity_remarks(double spacing_m, double peak_depth_m);

}  // namespace tpm::law
