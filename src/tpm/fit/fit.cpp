#include "tpm/fit/fit.hpp"

#include <algorithm>

#include "tpm/fit/conditional.hpp"
#include "tpm/fit/fit_flags.hpp"
#include "tpm/fit/fitted_data.hpp"
#include "tpm/fit/hypothesis_test.hpp"
#include "tpm/fit/likelihood/experiment_refit.hpp"
#include "tpm/fit/likelihood/starts.hpp"
#include "tpm/fit/unpredicted.hpp"

namespace tpm::fit {
namespace {

constexpr Eigen::Index kMostSearched = 20'000;   // residuals that many starts are followed with
constexpr std::size_t kThinnedTo = 2'000;        // samples that stand for a longer recording
constexpr std::size_t kMostSurrogateMinima = 5;  // minima of a cheap model that are gone on from

/// Where the search begins and how it goes on from there.
struct Approach {
  std::vector<std::vector<double>> starts;
  StartKind kind;
};

/// What a search with a stand-in for the function finds; no profiles.
FitResult survey(const ExperimentResiduals& stand_in, std::span<const FitParameter> parameters) {
  Threshold threshold;
  threshold.scale_known = stand_in.config().scale_known();
  threshold.data_count = static_cast<int>(stand_in.residual_count());
  return fit_residuals(stand_in, {parameters.begin(), parameters.end()},
                       fit_starts(stand_in, parameters), threshold, false, start_kind(stand_in));
}

/// The configured start, and the minima of a cheap model.
Approach surrogate_approach(const ExperimentResiduals& surrogate,
                            std::span<const FitParameter> parameters) {
  Approach approach{{start_values(parameters)}, StartKind::solved};
  for (const DistinctMinimum& m : survey(surrogate, parameters).minima) {
    if (approach.starts.size() > kMostSurrogateMinima) break;
    approach.starts.push_back(m.minimum.natural);
  }
  return approach;
}

/// Long recordings are approached through a few of their samples; the minimum is then found with
/// all of them.
Approach approach_to(const ExperimentResiduals& function,
                     std::span<const FitParameter> parameters) {
  if (const ExperimentResiduals* surrogate = function.surrogate())
    return surrogate_approach(*surrogate, parameters);
  if (function.residual_count() <= kMostSearched) {
    return {fit_starts(function, parameters), start_kind(function)};
  }
  const auto few = function.thinned(kThinnedTo);
  return {{survey(*few, parameters).best.natural}, StartKind::solved};
}

/// Where no start can be evaluated, the reason is said if it lies in the recording.
FitResult search(const ExperimentResiduals& function, const std::vector<FitParameter>& parameters,
                 const Threshold& threshold, bool profiles) {
  try {
    const Approach approach = approach_to(function, parameters);
    return fit_residuals(
        function, parameters, approach.starts, threshold, profiles, approach.kind,
        [&](std::span<const double> best) { return inflation_at(function, best); });
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
    if (const auto reason = unpredicted_window(function, start_values(parameters))) throw *reason;
    throw;
  }
}

/// The search, with automatic bounds widened until the fit no longer presses on them.
/// @param parameters their bounds are changed
FitResult widened_search(const ExperimentResiduals& function, std::vector<FitParameter>& parameters,
                         const Threshold& threshold) {
  const FitConfig& config = function.config();
  const bool automatic = std::ranges::any_of(
      config.parameters, [](const EstimatedParameter& p) { return p.widest.has_value(); });
  for (;;) {
    // Profiles are walked only from an estimate that stays.
    if (automatic && config.profiles) {
      while (widen_pressed_bounds(search(function, parameters, threshold, false), config,
                                  parameters)) {
      }
    }
    FitResult result = search(function, parameters, threshold, config.profiles);
    if (!automatic || !widen_pressed_bounds(result, config, parameters)) return result;
  }
}

/// The configuration with the bounds that were used at last.
void keep_bounds(FitResult& result, const std::vector<FitParameter>& parameters) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    FitParameter& first = result.config.parameters[i].fit;
    if (first.lower != parameters[i].lower || first.upper != parameters[i].upper) {
      result.parameters[i].first_bounds = Limits{first.lower, first.upper};
    }
    first = parameters[i];
  }
}

}  // namespace

FitResult run_fit(const FitConfig& config) {
  return run_fit(config, load_data(config));
}

FitResult run_fit(const FitConfig& config, const std::vector<DataSet>& data) {
  FitResult result = fit_experiments(ExperimentResiduals(config, data));
  for (const DataSet& set : data) {
    result.data_sha256.push_back(std::visit([](const auto& d) { return d.header.sha256; }, set));
  }
  return result;
}

FitResult fit_experiments(const ExperimentResiduals& function) {
  const FitConfig& config = function.config();
  std::vector<FitParameter> parameters = searched_parameters(config);
  Threshold threshold{config.level, config.scale_known(), function.value_count(),
                      static_cast<int>(parameters.size())};
  FitResult result = widened_search(function, parameters, threshold);
  threshold.inflation = result.inflation;
  result.config = config;
  keep_bounds(result, parameters);
  result.value_count = function.value_count();
  result.band_count = function.band_count();
  result.likelihood = likelihood_at(function, result.best.natural);
  result.correlation = correlation_at(function, result.best.natural);
  fill_data(result, function, parameters, threshold);
  for (const Hypothesis& hypothesis : config.hypotheses) {
    result.hypotheses.push_back(
        test_hypothesis(function, result, parameters, hypothesis, threshold));
  }
  if (config.bootstrap) {
    result.bootstrap = bootstrap_experiments(function, parameters, result.best, *config.bootstrap);
  }
  mark_conditions(result, function);
  add_flags(result, function);
  return result;
}

}  // namespace tpm::fit
