#pragma once
#include <string_view>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"

namespace tpm::fit {

/// Shape of the standardised error z.
enum class ErrorShape {
  normal,     ///< -2 ln p = z^2 + const
  laplace,    ///< -2 ln p = 2 |z| + const; one reading in 17 beyond 2 standard deviations
  student_t,  ///< -2 ln p = (nu + 1) ln(1 + z^2 / nu) + const
};

/// The coordinate T in which the error adds: T(y) = T(f) + sigma z. PEtab's noise distributions
/// normal, log-normal, log10-normal, laplace, log-laplace and log10-laplace are shape and scale.
enum class ErrorScale { linear, ln, log10 };

/// Distribution of a reading about the model's answer. Throughout, sigma is the law's SCALE: the
/// standard deviation of T(y) only for `normal`. A Laplace law has the standard deviation
/// sqrt(2) sigma, Student's t sqrt(nu / (nu - 2)) sigma. PEtab's noise formula is the scale, too.
struct ErrorLaw {
  ErrorShape shape = ErrorShape::normal;
  ErrorScale scale = ErrorScale::linear;
  double degrees_of_freedom = 4.0;  ///< nu of student_t, > 2 so that a standard deviation exists
};

[[nodiscard]] std::string_view error_shape_name(ErrorShape shape) noexcept;

/// Throws Error(bad_input) naming `where` if nu is not a finite number above 2.
void require_valid(const ErrorLaw& law, std::string_view where);

/// Half-width of the parabola that replaces the tip of 2 |z|, in scales: rho = 2 sqrt(z^2 + w^2) -
/// 2 w. Gauss-Newton needs a slope at z = 0. For |z| >> w the deviance of each datum is smaller by
/// the constant 2 w; differences between two fits change by about w^2 per datum.
inline constexpr double kLaplaceTip = 1e-2;

/// A residual and its derivative by z.
struct ShapedResidual {
  double r = 0.0;
  double slope = 1.0;
};

/// The residual whose square is rho(z) = -2 ln p(z) + 2 ln p(0), of z's sign. Exact for normal and
/// student_t; laplace with the tip above.
[[nodiscard]] ShapedResidual shaped_residual(const ErrorLaw& law, double z);

/// ln of the density of y, all constants included, so that likelihoods of different laws and scales
/// compare; the density is with respect to y itself, also on the log scales (1/y or 1/(y ln 10)).
/// Without the tip. Minus infinity if y or f is not positive on a log scale.
/// @param sigma the law's scale, > 0, on `scale`
[[nodiscard]] double log_density(const ErrorLaw& law, double y, double f, double sigma);

/// Standard deviation of T(y) for a scale of sigma.
[[nodiscard]] double standard_deviation(const ErrorLaw& law, double sigma);

/// Expected Fisher information of one datum about T(f), in units of 1 / sigma^2, and about ln
/// sigma. Between the two it is zero, because the laws are symmetric.
[[nodiscard]] double location_information(const ErrorLaw& law);
[[nodiscard]] double scale_information(const ErrorLaw& law);

/// A standardised error of the law's shape.
[[nodiscard]] double draw_error(const ErrorLaw& law, Random& random);

/// y from T(y) = T(f) + sigma z.
[[nodiscard]] double scattered(const ErrorLaw& law, double f, double sigma, double z);

/// T and its derivative; f > 0 on the log scales.
[[nodiscard]] double transformed(ErrorScale scale, double f);
[[nodiscard]] double transformed_slope(ErrorScale scale, double f);

}  // namespace tpm::fit
