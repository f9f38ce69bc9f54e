#include "tpm/fit/likelihood/noise.hpp"

#include <ceres/loss_function.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tpm/base/text.hpp"
#include "tpm/fit/likelihood/fit_words.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

std::string_view noise_kind_name(NoiseKind kind) noexcept {
  return entry_of(kNoiseKindWords, kind).text;
}

bool uses_relative(NoiseKind kind) {
  return kind == NoiseKind::relative_to_datum || kind == NoiseKind::combined ||
         kind == NoiseKind::log || kind == NoiseKind::relative_to_model;
}

bool uses_absolute(NoiseKind kind) {
  return kind == NoiseKind::absolute || kind == NoiseKind::combined;
}

std::string_view loss_name(Loss loss) noexcept {
  return entry_of(kLossWords, loss).text;
}

ErrorLaw error_law(const Noise& noise) {
  return {noise.shape, noise.kind == NoiseKind::log ? ErrorScale::ln : ErrorScale::linear,
          noise.degrees_of_freedom};
}

double sigma_of(const Noise& noise, double datum, std::optional<double> row_sd,
                std::string_view where) {
  double sigma = 0.0;
  switch (noise.kind) {
    case NoiseKind::relative_to_datum:
      sigma = noise.relative * std::abs(datum);
      break;
    case NoiseKind::absolute:
      sigma = noise.absolute;
      break;
    case NoiseKind::combined:
      sigma = noise.absolute + noise.relative * std::abs(datum);
      break;
    case NoiseKind::per_row:
      if (!row_sd) {
        throw bad_input(where, "noise 'per_row', but the datum has no standard deviation",
                        "a column of standard deviations or another noise kind");
      }
      sigma = *row_sd;
      break;
    case NoiseKind::log:
    case NoiseKind::relative_to_model:
      if (!(datum > 0.0)) {
        throw bad_input(where,
                        fmt::format("a datum of {} (SI) under noise '{}'", shortest(datum),
                                    noise_kind_name(noise.kind)),
                        "data above 0");
      }
      sigma = noise.relative;
      break;
  }
  if (!(sigma > 0.0 && std::isfinite(sigma))) {
    throw bad_input(where,
                    fmt::format("the datum {} (SI) has a standard deviation of {} under noise '{}'",
                                shortest(datum), shortest(sigma), noise_kind_name(noise.kind)),
                    "a positive standard deviation");
  }
  return sigma;
}

PartsNoise noise_of_parts(const Noise& noise, double storage, double loss) {
  const double size = noise.relative, angle = noise.angle_rad.value();
  PartsNoise parts{std::hypot(size * storage, angle * loss),
                   std::hypot(size * loss, angle * storage)};
  const double covariance = (size * size - angle * angle) * storage * loss;
  parts.correlation = covariance / (parts.storage_sd * parts.loss_sd);
  return parts;
}

std::optional<DatumResidual> value_residual(const Noise& noise, double sigma, double datum,
                                            double f) {
  DatumResidual residual;
  switch (noise.kind) {
    case NoiseKind::log:
      if (!(f > 0.0)) return std::nullopt;
      residual.r = std::log(f / datum) / sigma;
      residual.d_r = 1.0 / (f * sigma);
      return residual;
    case NoiseKind::relative_to_model: {
      if (!(f > 0.0)) return std::nullopt;
      residual.r = (1.0 - datum / f) / sigma;
      residual.d_r = datum / (f * f * sigma);
      const double argument = 2.0 * std::log(f / datum) + kNormalisationOffset;
      if (!(argument > 0.0)) return std::nullopt;
      residual.normalisation = std::sqrt(argument);
      residual.d_normalisation = 1.0 / (f * residual.normalisation);
      return residual;
    }
    case NoiseKind::relative_to_datum:
    case NoiseKind::absolute:
    case NoiseKind::combined:
    case NoiseKind::per_row:
      break;
  }
  residual.r = (f - datum) / sigma;
  residual.d_r = 1.0 / sigma;
  return residual;
}

DatumResidual band_residual(double sigma, double lower, double upper, double f) {
  DatumResidual residual;
  if (f < lower) {
    residual.r = (f - lower) / sigma;
    residual.d_r = 1.0 / sigma;
  } else if (f > upper) {
    residual.r = (f - upper) / sigma;
    residual.d_r = 1.0 / sigma;
  }
  return residual;
}

DatumResidual censored_residual(double sigma, double scale, double lower, double upper, double f) {
  constexpr double kSure = 8.0;   // beyond, -2 ln P is below the rounding of a sum of squares
  constexpr double kFar = -25.0;  // below, erfc loses its digits
  if (!std::isfinite(sigma)) return {};
  const bool above = std::isfinite(lower);
  const double sign = above ? 1.0 : -1.0;
  const double z = sign * (f - (above ? lower : upper)) / (scale * sigma);
  if (z > kSure) return {};
  double minus_two_log = 0.0;
  double slope = 0.0;  // phi(z) / Phi(z)
  if (z > kFar) {
    const double p = 0.5 * std::erfc(-z / std::numbers::sqrt2);
    minus_two_log =
        z > 0.0 ? -2.0 * std::log1p(-0.5 * std::erfc(z / std::numbers::sqrt2)) : -2.0 * std::log(p);
    slope = std::exp(-0.5 * z * z) * std::numbers::inv_sqrtpi / std::numbers::sqrt2 / p;
  } else {  // the tail by its asymptotic series
    const double w = 1.0 / (z * z);
    const double series = 1.0 - w * (1.0 - 3.0 * w * (1.0 - 5.0 * w));
    const double root = std::sqrt(2.0 * std::numbers::pi);
    minus_two_log = z * z + 2.0 * std::log(-z * root) - 2.0 * std::log(series);
    slope = -z / series;
  }
  DatumResidual residual;
  const double root = std::sqrt(minus_two_log);
  residual.r = -sign * scale * root;
  residual.d_r = slope / (sigma * root);
  return residual;
}

void apply_shape(const ErrorLaw& law, DatumResidual& residual) {
  const ShapedResidual shaped = shaped_residual(law, residual.r);
  residual.r = shaped.r;
  residual.d_r *= shaped.slope;
}

void apply_loss(const RobustLoss& loss, DatumResidual& residual) {
  if (loss.kind == Loss::none || residual.r == 0.0) return;
  std::array<double, 3> rho{};
  const double square = residual.r * residual.r;
  if (loss.kind == Loss::huber) ceres::HuberLoss(loss.width).Evaluate(square, rho.data());
  if (loss.kind == Loss::cauchy) ceres::CauchyLoss(loss.width).Evaluate(square, rho.data());
  const double root = std::copysign(std::sqrt(rho[0]), residual.r);
  residual.d_r *= rho[1] * residual.r / root;
  residual.r = root;
}

}  // namespace tpm::fit
