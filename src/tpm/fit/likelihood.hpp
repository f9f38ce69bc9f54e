#pragma once
#include <optional>
#include <span>

#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace tpm::fit {

/// -2 ln L with all constants, and the criteria made of it: smaller is better, between fits to the
/// same readings, also under different noise distributions and scales.
struct Likelihood {
  double minus_two_log = 0.0;
  int readings = 0;            ///< n; bands are not counted
  int parameters = 0;          ///< k: all estimated ones, those of the noise too
  double aic = 0.0;            ///< -2 ln L + 2 k
  std::optional<double> aicc;  ///< AIC + 2 k (k + 1) / (n - k - 1); none for n <= k + 1
  double bic = 0.0;            ///< -2 ln L + k ln n
};

/// @param readings n >= 1
[[nodiscard]] Likelihood information_criteria(double minus_two_log, int readings, int parameters);

/// The likelihood of all fitted values at a minimum, the densities with respect to the data in SI.
/// Bands add their penalty, which is -2 ln of a density up to a constant. A common noise factor
/// that is estimated has its most likely value, sum z^2 / n, and counts as one parameter more.
/// @param natural the estimated parameters, SI
/// @return empty under a robust loss (it has no density), without values, and for an estimated
///         factor of zero (an exact fit)
[[nodiscard]] std::optional<Likelihood> likelihood_at(const ExperimentResiduals& function,
                                                      std::span<const double> natural);

}  // namespace tpm::fit
