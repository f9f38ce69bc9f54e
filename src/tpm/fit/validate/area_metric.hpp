#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tpm/base/namespaces.hpp"

namespace tpm::fit {

/// Area between the distribution function of N(mean, sd^2) and the empirical one of values, in
/// their unit (Ferson, Oberkampf and Ginzburg, Comput. Methods Appl. Mech. Engrg. 197 (2008) 2408),
/// in closed form. With sd = 0 the mean distance of the values from the mean. Throws
/// Error(bad_input) without values, or for numbers that are not finite.
[[nodiscard]] double area_metric(std::span<const double> values, double mean, double sd);

/// The same between two empirical distribution functions.
[[nodiscard]] double area_metric(std::span<const double> values, std::span<const double> others);

/// An area metric beside what the prediction itself would give.
struct AreaMetric {
  double area = 0.0;
  double null_mean = 0.0;              ///< mean of the area over draws of the prediction
  double null_95 = 0.0;                ///< 95 % point of it
  double p_value = 1.0;                ///< share of the draws with at least this area
  std::optional<double> lower, upper;  ///< 95 % interval, from 5 values on (bootstrap, percentile)
};

/// Of standardised errors z_j = (D_j - S_j) / u_j against N(0, 1). Draws of the prediction share
/// what the recordings share: z*_j = (shared_j zeta + own_j eps_j) / u_j.
/// @param shared one row a value; @param own standard uncertainties of the rest; u_j^2 is the sum
/// of
///        both squared
[[nodiscard]] AreaMetric standard_area(std::span<const double> z, const Eigen::MatrixXd& shared,
                                       std::span<const double> own, std::uint64_t seed = 0);

}  // namespace tpm::fit
