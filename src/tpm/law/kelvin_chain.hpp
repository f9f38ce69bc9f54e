#pragma once
#include <Eigen/Core>

#include "tpmkit/law.hpp"

namespace tpm::law {

/// Parallel form of a solid Kelvin chain with the derivatives of its coefficients.
struct ParallelWithSlopes {
  Prony law;
  /// d(k_inf, k_1.., tau_1..) / d(k0, kc_1.., T_1..), size (2n + 1) x (2n + 1)
  Eigen::MatrixXd slopes;
};

/// Units in any order; equal retardation times are nudged apart by 1e-9 so that the number of
/// branches stays that of the units.
[[nodiscard]] ParallelWithSlopes to_parallel_with_slopes(const KelvinChain& chain);

}  // namespace tpm::law
