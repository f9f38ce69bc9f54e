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

/// Kelvin chain of a law with the derivatives of its coefficients: d(k0, k_1.., T_1..) or, for a
/// fluid, d(k0, k_1..k_{n-1}, T_1..T_{n-1}, eta), by (k_inf, k_1.., tau_1..). All k_i > 0.
struct SeriesWithSlopes {
  KelvinChain chain;
  Eigen::MatrixXd slopes;
};

[[nodiscard]] SeriesWithSlopes to_series_with_slopes(const Prony& law);

}  // namespace tpm::law
