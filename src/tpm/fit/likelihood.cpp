#include "tpm/fit/likelihood.hpp"

#include <cmath>

namespace tpm::fit {
namespace {

/// Sum of the squared standardised residuals of values over their number.
double mean_square(const ExperimentResiduals& function, const Eigen::VectorXd& answer,
                   std::span<const double> natural) {
  double sum = 0.0;
  for (std::size_t i = 0; i < function.data().size(); ++i) {
    const FitDatum& d = function.data()[i];
    if (d.held_out || !d.value) continue;
    const double z = function.standardised(i, answer[static_cast<Eigen::Index>(i)], natural);
    sum += z * z;
  }
  return sum / function.value_count();
}

}  // namespace

Likelihood information_criteria(double minus_two_log, int readings, int parameters) {
  Likelihood result;
  result.minus_two_log = minus_two_log;
  result.readings = readings;
  result.parameters = parameters;
  const double k = parameters;
  const double spare = readings - k - 1.0;
  result.aic = minus_two_log + 2.0 * k;
  if (spare > 0.0) result.aicc = result.aic + 2.0 * k * (k + 1.0) / spare;
  result.bic = minus_two_log + k * std::log(static_cast<double>(readings));
  return result;
}

std::optional<Likelihood> likelihood_at(const ExperimentResiduals& function,
                                        std::span<const double> natural) {
  const FitConfig& config = function.config();
  if (config.loss.kind != Loss::none || function.value_count() == 0) return std::nullopt;
  const Eigen::VectorXd answer = function.predict(natural, nullptr);
  const bool scale_known = config.scale_known();
  const double factor = scale_known ? 1.0 : std::sqrt(mean_square(function, answer, natural));
  if (!(factor > 0.0)) return std::nullopt;
  double sum = 0.0;
  for (std::size_t i = 0; i < function.data().size(); ++i) {
    const FitDatum& d = function.data()[i];
    if (d.held_out) continue;
    const double f = answer[static_cast<Eigen::Index>(i)];
    if (d.value) {
      const double scale = factor * function.noise_scale(i, f, natural);
      sum -= 2.0 * log_density(error_law(config.data[d.choice].noise), *d.value, f, scale);
    } else if (d.at_limit) {
      const double r = censored_residual(d.sigma * factor, 1.0, *d.lower, *d.upper, f).r;
      sum += r * r;
    } else {
      const double outside = function.standardised(i, f, natural) / factor;
      sum += outside * outside;
    }
  }
  return information_criteria(sum, function.value_count(),
                              static_cast<int>(natural.size()) + (scale_known ? 0 : 1));
}

}  // namespace tpm::fit
