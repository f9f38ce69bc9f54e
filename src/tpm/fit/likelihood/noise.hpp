#pragma once
#include <optional>
#include <string_view>

#include "tpm/fit/likelihood/error_law.hpp"

namespace tpm::fit {

/// Scatter of a reading about the true value. f is the model's answer, y the datum.
enum class NoiseKind {
  relative_to_datum,  ///< normal, sigma = b |y|
  absolute,           ///< normal, sigma = a
  combined,           ///< normal, sigma = a + b |y|
  per_row,            ///< normal, sigma from the data file's standard deviation column
  log,                ///< log-normal: ln(f / y) normal with sigma = b
  relative_to_model,  ///< normal, sigma = b |f|; its 2 ln(sigma) is part of the deviance
};

/// A declared noise model. `scale_known` false means that a, b or the column are right only up to
/// one common factor, which is estimated: chi-square thresholds become F thresholds.
struct Noise {
  NoiseKind kind = NoiseKind::relative_to_datum;
  double absolute = 0.0;  ///< a, SI unit of the datum
  double relative = 0.1;  ///< b, dimensionless
  /// Of a spectrum that was measured as magnitude and phase, with b |y|: standard deviation of the
  /// phase, rad; b is then that of the magnitude.
  std::optional<double> angle_rad = std::nullopt;
  bool scale_known = true;
  /// Where it is not normal, a, b and the column are the law's scale, see ErrorLaw.
  ErrorShape shape = ErrorShape::normal;
  double degrees_of_freedom = 4.0;  ///< of student_t, > 2
};

/// Shape of the noise and the scale on which it adds.
[[nodiscard]] ErrorLaw error_law(const Noise& noise);

[[nodiscard]] std::string_view noise_kind_name(NoiseKind kind) noexcept;

/// True if b and a are part of the standard deviation.
[[nodiscard]] bool uses_relative(NoiseKind kind);
[[nodiscard]] bool uses_absolute(NoiseKind kind);

/// Down-weighting of outliers, applied to each standardised residual r as sign(r) sqrt(rho(r^2)).
enum class Loss {
  none,
  huber,   ///< quadratic up to the width, linear beyond
  cauchy,  ///< width^2 ln(1 + r^2/width^2)
};

struct RobustLoss {
  Loss kind = Loss::none;
  double width = 1.345;  ///< in standard deviations, > 0
};

[[nodiscard]] std::string_view loss_name(Loss loss) noexcept;

/// Contribution of one datum: up to two residuals with their derivatives by f.
struct DatumResidual {
  double r = 0.0, d_r = 0.0;
  double normalisation = 0.0, d_normalisation = 0.0;  ///< sqrt(2 ln(f/|y|) + kNormalisationOffset)
};

/// Added under the square root of the normalisation residual so that it stays real; its square is
/// subtracted again from the deviance (ResidualFunction::offset).
inline constexpr double kNormalisationOffset = 50.0;

/// Standard deviation of a datum, SI; for `log` of its logarithm. Throws Error(bad_input) naming
/// `where` if it is not a positive number (a datum of 0 under relative noise, a missing column).
[[nodiscard]] double sigma_of(const Noise& noise, double datum, std::optional<double> row_sd,
                              std::string_view where);

/// Noise of the storage and the loss of one frequency, SI, and its correlation.
struct PartsNoise {
  double storage_sd = 0.0, loss_sd = 0.0, correlation = 0.0;
};

/// The same where magnitude and phase were measured, with noise of their own: d storage = storage
/// d ln(magnitude) - loss d phase, d loss = loss d ln(magnitude) + storage d phase.
/// @param noise with a standard deviation of the phase
[[nodiscard]] PartsNoise noise_of_parts(const Noise& noise, double storage, double loss);

/// Residual of a value. Empty if the model's answer has no likelihood there (f <= 0 under `log` or
/// `relative_to_model`).
[[nodiscard]] std::optional<DatumResidual> value_residual(const Noise& noise, double sigma,
                                                          double datum, double f);

/// Residual of a band: zero inside, a one-sided normal tail of the given sigma outside.
[[nodiscard]] DatumResidual band_residual(double sigma, double lower, double upper, double f);

/// Residual of a censored reading, of which is known that it lay in a band that is open on one
/// side: its square is scale^2 (-2 ln P) with P = Phi((f - lower) / (scale sigma)), or Phi((upper -
/// f) / (scale sigma)) (Tobin 1958). 0 for an infinite sigma.
/// @param scale size of the noise in units of sigma, > 0: squares of values are not divided by it
[[nodiscard]] DatumResidual censored_residual(double sigma, double scale, double lower,
                                              double upper, double f);

/// Applies the shape of the law to r and d_r, which stand for z; `normal` changes nothing.
void apply_shape(const ErrorLaw& law, DatumResidual& residual);

/// Applies the loss to r and d_r.
void apply_loss(const RobustLoss& loss, DatumResidual& residual);

}  // namespace tpm::fit
