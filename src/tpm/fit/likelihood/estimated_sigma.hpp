#pragma once
#include <optional>

#include "tpm/fit/likelihood/error_law.hpp"

namespace tpm::fit {

/// sigma = a + b |f| with a, b or both among the estimated parameters. sigma is the law's scale, on
/// the law's scale: for `ln` and `log10` a is dimensionless, and b is 1 / unit of f.
struct EstimatedSigma {
  std::optional<double> fixed_a;  ///< unit of T(f), >= 0; empty: estimated
  std::optional<double> fixed_b;  ///< >= 0; empty: estimated
  /// Size of the data in the unit of T(f), > 0: sigma may go down to 1e-10 of it (and up without
  /// limit) before noise_residual refuses.
  double reference = 1.0;
};

/// A quantity with its derivatives by the model's answer and by a and b (zero for a fixed one).
struct NoiseTerm {
  double value = 0.0;
  double by_f = 0.0, by_a = 0.0, by_b = 0.0;
};

/// Two residuals of one datum: value^2 + normalisation^2 is the datum's deviance with its 2 ln
/// sigma. ResidualFunction::offset() must hold kNormalisationOffset for every such datum; then
/// -2 ln L = deviance + sum of -2 log_density(law, y, y, reference).
struct NoiseResidual {
  NoiseTerm residual;       ///< shaped_residual of (T(f) - T(y)) / sigma
  NoiseTerm normalisation;  ///< sqrt(2 ln(sigma / reference) + kNormalisationOffset)
};

/// @param a,b current values; ignored where fixed
/// @return empty where there is no likelihood: sigma not positive or not finite, y or f not
///         positive on a log scale, sigma below 1e-10 of the reference
[[nodiscard]] std::optional<NoiseResidual> noise_residual(const ErrorLaw& law,
                                                          const EstimatedSigma& sigma, double y,
                                                          double f, double a, double b);

/// The derivatives whose J^T J is the expected Fisher information of the datum, in the same two
/// rows (values are not set). The residuals' own Jacobian gives about half of the information about
/// sigma, and none that is right for a law that is not normal: it is for descending, this for
/// standard errors.
[[nodiscard]] std::optional<NoiseResidual> noise_information(const ErrorLaw& law,
                                                             const EstimatedSigma& sigma, double f,
                                                             double a, double b);

}  // namespace tpm::fit
