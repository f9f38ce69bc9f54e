#include "tpm/fit/measured_at_rest.hpp"

#include <algorithm>

#include "tpm/fit/likelihood/experiment_residuals.hpp"

namespace tpm::fit {
namespace {

/// A prior that does not say what measured it is a measurement of its own.
bool is_of_readings(const EstimatedParameter& p) {
  return p.prior && p.prior->measured && !p.prior->from.empty();
}

bool is_measured_zero_of(const ExperimentResiduals& function, const EstimatedParameter& p,
                         std::size_t choice) {
  if (!is_of_readings(p)) return false;
  return std::ranges::any_of(p.sets, [&](const Target& target) {
    return function.model().parameters()[target.parameter].name == "offset" &&
           target.applies_to(choice);
  });
}

std::size_t place_among_priors(const FitConfig& config, const EstimatedParameter& p) {
  const auto place = &p - config.parameters.data();
  return static_cast<std::size_t>(
      std::count_if(config.parameters.begin(), config.parameters.begin() + place,
                    [](const EstimatedParameter& each) { return each.prior.has_value(); }));
}

}  // namespace

Eigen::Vector2d MeasuredAtRest::covariance_with_last(double variance) const {
  const double away_s = last_s - origin_s;
  const Eigen::Vector2d of_last(zero_sd * zero_sd, drift_sd * drift_sd * away_s);
  const double line = of_last[0] + of_last[1] * away_s;
  return std::min(1.0, variance * sigma * sigma / line) / sigma * of_last;
}

std::optional<MeasuredAtRest> measured_at_rest(const ExperimentResiduals& function,
                                               const Experiment& experiment, double step_s) {
  const FitConfig& config = function.config();
  if (config.data[experiment.choice].noise.kind == NoiseKind::log) return std::nullopt;
  const auto first = std::ranges::find_if(experiment.data, [&](std::size_t i) {
    return !function.data()[i].held_out && function.data()[i].value.has_value();
  });
  const auto drift = std::ranges::find_if(config.parameters, [&](const EstimatedParameter& p) {
    return is_of_readings(p) && p.drift && p.drift->choice == experiment.choice;
  });
  const auto zero = std::ranges::find_if(config.parameters, [&](const EstimatedParameter& p) {
    return is_measured_zero_of(function, p, experiment.choice);
  });
  if (first == experiment.data.end() || drift == config.parameters.end() ||
      zero == config.parameters.end()) {
    return std::nullopt;
  }
  // The middle of rests on both sides, or of one before.
  const double origin_s = drift->drift->origin_s;
  if (!(origin_s < function.data()[experiment.data.back()].time_s)) return std::nullopt;
  MeasuredAtRest rest;
  rest.last_s = function.data()[*first].time_s - step_s;
  rest.origin_s = origin_s;
  rest.sigma = function.data()[*first].sigma;
  rest.zero_sd = zero->prior->sd;
  rest.drift_sd = drift->prior->sd;
  rest.zero_prior = place_among_priors(config, *zero);
  rest.drift_prior = place_among_priors(config, *drift);
  return rest;
}

}  // namespace tpm::fit
