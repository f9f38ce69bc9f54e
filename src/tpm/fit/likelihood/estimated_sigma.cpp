#include "tpm/fit/likelihood/estimated_sigma.hpp"

#include <cmath>

#include "tpm/fit/likelihood/noise.hpp"

namespace tpm::fit {
namespace {

/// sigma and its derivatives; empty if it is not a positive number.
std::optional<NoiseTerm> sigma_at(const EstimatedSigma& sigma, double f, double a, double b) {
  const double a_used = sigma.fixed_a.value_or(a);
  const double b_used = sigma.fixed_b.value_or(b);
  NoiseTerm s;
  s.value = a_used + b_used * std::abs(f);
  if (!(s.value > 0.0 && std::isfinite(s.value))) return std::nullopt;
  if (f != 0.0) s.by_f = std::copysign(b_used, f);
  s.by_a = sigma.fixed_a ? 0.0 : 1.0;
  s.by_b = sigma.fixed_b ? 0.0 : std::abs(f);
  return s;
}

/// The derivatives of a term that depends on sigma only.
NoiseTerm through_sigma(const NoiseTerm& sigma, double value, double by_sigma) {
  return {value, by_sigma * sigma.by_f, by_sigma * sigma.by_a, by_sigma * sigma.by_b};
}

}  // namespace

std::optional<NoiseResidual> noise_residual(const ErrorLaw& law, const EstimatedSigma& sigma,
                                            double y, double f, double a, double b) {
  if (law.scale != ErrorScale::linear && !(y > 0.0 && f > 0.0)) return std::nullopt;
  const std::optional<NoiseTerm> s = sigma_at(sigma, f, a, b);
  if (!s) return std::nullopt;
  const double argument = 2.0 * std::log(s->value / sigma.reference) + kNormalisationOffset;
  if (!(argument > 0.0)) return std::nullopt;
  const double z = (transformed(law.scale, f) - transformed(law.scale, y)) / s->value;
  const ShapedResidual shaped = shaped_residual(law, z);
  NoiseResidual result;
  result.residual = through_sigma(*s, shaped.r, -shaped.slope * z / s->value);
  result.residual.by_f += shaped.slope * transformed_slope(law.scale, f) / s->value;
  const double root = std::sqrt(argument);
  result.normalisation = through_sigma(*s, root, 1.0 / (s->value * root));
  return result;
}

std::optional<NoiseResidual> noise_information(const ErrorLaw& law, const EstimatedSigma& sigma,
                                               double f, double a, double b) {
  if (law.scale != ErrorScale::linear && !(f > 0.0)) return std::nullopt;
  const std::optional<NoiseTerm> s = sigma_at(sigma, f, a, b);
  if (!s) return std::nullopt;
  NoiseResidual result;
  result.residual.by_f =
      std::sqrt(location_information(law)) * transformed_slope(law.scale, f) / s->value;
  result.normalisation = through_sigma(*s, 0.0, std::sqrt(scale_information(law)) / s->value);
  return result;
}

}  // namespace tpm::fit
