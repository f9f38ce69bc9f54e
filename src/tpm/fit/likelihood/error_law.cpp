#include "tpm/fit/likelihood/error_law.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tpm/base/distributions.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/likelihood/fit_words.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// ln p(z) of the standardised error.
double standard_log_density(const ErrorLaw& law, double z) {
  const double nu = law.degrees_of_freedom;
  switch (law.shape) {
    case ErrorShape::normal:
      return -0.5 * (z * z + std::log(2.0 * std::numbers::pi));
    case ErrorShape::laplace:
      return -std::abs(z) - std::numbers::ln2;
    case ErrorShape::student_t:
      return log_gamma(0.5 * (nu + 1.0)) - log_gamma(0.5 * nu) -
             0.5 * std::log(nu * std::numbers::pi) - 0.5 * (nu + 1.0) * std::log1p(z * z / nu);
  }
  return 0.0;
}

}  // namespace

std::string_view error_shape_name(ErrorShape shape) noexcept {
  return entry_of(kErrorShapeWords, shape).text;
}

void require_valid(const ErrorLaw& law, std::string_view where) {
  const double nu = law.degrees_of_freedom;
  if (law.shape != ErrorShape::student_t || (nu > 2.0 && std::isfinite(nu))) return;
  throw bad_input(where, fmt::format("{} degrees of freedom of Student's t", shortest(nu)),
                  "a number above 2");
}

ShapedResidual shaped_residual(const ErrorLaw& law, double z) {
  switch (law.shape) {
    case ErrorShape::normal:
      break;
    case ErrorShape::laplace: {
      const double hypotenuse = std::hypot(z, kLaplaceTip);
      const double factor = std::sqrt(2.0 / (hypotenuse + kLaplaceTip));
      // d ln(factor) / dz = -z / (2 hypotenuse (hypotenuse + w))
      const double bend = z * z / (2.0 * hypotenuse * (hypotenuse + kLaplaceTip));
      return {z * factor, factor * (1.0 - bend)};
    }
    case ErrorShape::student_t: {
      const double nu = law.degrees_of_freedom;
      const double r = std::copysign(std::sqrt((nu + 1.0) * std::log1p(z * z / nu)), z);
      // Below this z the square root is straight to rounding, and z^2 would lose its digits.
      constexpr double kStraight = 1e-9;
      const double straight = std::sqrt((nu + 1.0) / nu);
      if (std::abs(z) < kStraight) return {z * straight, straight};
      return {r, (nu + 1.0) * z / ((nu + z * z) * r)};
    }
  }
  return {z, 1.0};
}

double transformed(ErrorScale scale, double f) {
  switch (scale) {
    case ErrorScale::linear:
      break;
    case ErrorScale::ln:
      return std::log(f);
    case ErrorScale::log10:
      return std::log10(f);
  }
  return f;
}

double transformed_slope(ErrorScale scale, double f) {
  switch (scale) {
    case ErrorScale::linear:
      break;
    case ErrorScale::ln:
      return 1.0 / f;
    case ErrorScale::log10:
      return 1.0 / (f * std::numbers::ln10);
  }
  return 1.0;
}

double log_density(const ErrorLaw& law, double y, double f, double sigma) {
  if (law.scale != ErrorScale::linear && !(y > 0.0 && f > 0.0)) {
    return -std::numeric_limits<double>::infinity();
  }
  const double z = (transformed(law.scale, y) - transformed(law.scale, f)) / sigma;
  return standard_log_density(law, z) - std::log(sigma) + std::log(transformed_slope(law.scale, y));
}

double standard_deviation(const ErrorLaw& law, double sigma) {
  const double nu = law.degrees_of_freedom;
  switch (law.shape) {
    case ErrorShape::normal:
      break;
    case ErrorShape::laplace:
      return std::numbers::sqrt2 * sigma;
    case ErrorShape::student_t:
      return sigma * std::sqrt(nu / (nu - 2.0));
  }
  return sigma;
}

double location_information(const ErrorLaw& law) {
  const double nu = law.degrees_of_freedom;
  return law.shape == ErrorShape::student_t ? (nu + 1.0) / (nu + 3.0) : 1.0;
}

double scale_information(const ErrorLaw& law) {
  const double nu = law.degrees_of_freedom;
  switch (law.shape) {
    case ErrorShape::normal:
      break;
    case ErrorShape::laplace:
      return 1.0;
    case ErrorShape::student_t:
      return 2.0 * nu / (nu + 3.0);
  }
  return 2.0;
}

double draw_error(const ErrorLaw& law, Random& random) {
  const double nu = law.degrees_of_freedom;
  switch (law.shape) {
    case ErrorShape::normal:
      break;
    case ErrorShape::laplace: {
      // 1 - u lies in (0, 1], where the logarithm is finite.
      const double size = -std::log(1.0 - random.uniform());
      return random.uniform() < 0.5 ? -size : size;
    }
    case ErrorShape::student_t: {
      const double z = random.normal();
      // The middle of one of 2^53 cells: never 0 or 1.
      const double u = random.uniform() + 0x1.0p-54;
      return z / std::sqrt(chi_squared_quantile(u, nu) / nu);
    }
  }
  return random.normal();
}

double scattered(const ErrorLaw& law, double f, double sigma, double z) {
  switch (law.scale) {
    case ErrorScale::linear:
      break;
    case ErrorScale::ln:
      return f * std::exp(sigma * z);
    case ErrorScale::log10:
      return f * std::pow(10.0, sigma * z);
  }
  return f + sigma * z;
}

}  // namespace tpm::fit
