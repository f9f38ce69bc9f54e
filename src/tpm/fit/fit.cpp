#include "tpm/fit/fit.hpp"
#include "tpm/fit/likelihood/quantum.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "tpm/fit/conditional.hpp"
#include "tpm/fit/confirmation.hpp"
#include "tpm/fit/fit_flags.hpp"
#include "tpm/fit/fitted_data.hpp"
#include "tpm/fit/hypothesis_test.hpp"
#include "tpm/fit/likelihood/experiment_refit.hpp"
#include "tpm/fit/likelihood/starts.hpp"
#include "tpm/fit/outliers.hpp"
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

/// Result of a search with a stand-in for the function; no profiles.
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

/// Where a search begins: at minima that are near, or anywhere if there are none.
struct NearMinima {
  std::vector<std::vector<double>> natural;
  std::vector<int> starts;  ///< that had led to each
};

/// Where no start can be evaluated, the reason is said if it lies in the recording.
FitResult search(const ExperimentResiduals& function, const std::vector<FitParameter>& parameters,
                 const Threshold& threshold, bool profiles, const NearMinima& near) {
  try {
    const Approach approach = near.natural.empty() ? approach_to(function, parameters)
                                                   : Approach{near.natural, StartKind::solved};
    return fit_residuals(
        function, parameters, approach.starts, threshold, profiles, approach.kind,
        [&](std::span<const double> best, Threshold& at) {
          at.noise = noise_of_estimates(function, parameters, best);
          at.inflation = at.noise ? at.noise->inflation : inflation_at(function, best);
        },
        near.starts);
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical) throw;
    if (const auto reason = unpredicted_window(function, start_values(parameters))) throw *reason;
    throw;
  }
}

/// The search, with automatic bounds widened until the fit no longer presses on them.
/// @param parameters their bounds are changed
FitResult widened_search(const ExperimentResiduals& function, std::vector<FitParameter>& parameters,
                         const Threshold& threshold, bool profiles, const NearMinima& near) {
  const FitConfig& config = function.config();
  const bool automatic = std::ranges::any_of(
      config.parameters, [](const EstimatedParameter& p) { return p.widest.has_value(); });
  for (;;) {
    // Profiles are walked only from an estimate that stays.
    if (automatic && profiles) {
      while (widen_pressed_bounds(search(function, parameters, threshold, false, near), config,
                                  parameters)) {
      }
    }
    FitResult result = search(function, parameters, threshold, profiles, near);
    if (!automatic || !widen_pressed_bounds(result, config, parameters)) return result;
  }
}

NearMinima minima_of(const FitResult& result) {
  NearMinima minima;
  for (const DistinctMinimum& m : result.minima) {
    if (minima.natural.size() == kMostSurrogateMinima) break;
    minima.natural.push_back(m.minimum.natural);
    minima.starts.push_back(m.starts);
  }
  return minima;
}

/// A prior is stated in absolute terms, the noise of the readings up to a factor s that the fit
/// finds. The minimum of
///
///     n_eff ln(RSS) + sum ((p - mean) / sd)^2
///
/// is that of RSS + s^2 sum ((p - mean) / sd)^2 with s^2 = RSS / n_eff, found by repetition. It
/// begins with priors that hold (s of the declared noise): where a law does not describe the data,
/// a placement that was measured stays and the residual tells. Censored readings are asked the same
/// way: their likelihood takes that s, too, and before it is known they are left out.
FitResult balanced_search(ExperimentResiduals& function, std::vector<FitParameter>& parameters,
                          const Threshold& threshold) {
  constexpr int kMostRounds = 40;
  constexpr double kSettled = 1e-3, kLeast = 1e-12;
  const bool profiles = function.config().profiles;
  FitResult result = widened_search(function, parameters, threshold, false, {});
  const FitResult survey = result;
  double weight = 1.0;
  const bool censored = function.has_censored();
  for (int round = 0; round < kMostRounds; ++round) {
    const double next = std::max(std::sqrt(result.inflation * result.variance_factor), kLeast);
    const bool settled = std::abs(next - weight) <= kSettled * weight;
    if (settled && !(censored && round == 0)) break;
    weight = next;
    function.set_prior_weight(weight);
    if (censored) {
      function.set_noise_scale(std::max(std::sqrt(result.variance_factor), kLeast));
    }
    result = search(function, parameters, threshold, false, minima_of(result));
  }
  // Without profiles the last round is the answer, unless it presses on a bound that can move.
  if (profiles || widen_pressed_bounds(result, function.config(), parameters)) {
    result = widened_search(function, parameters, threshold, profiles, minima_of(result));
  }
  result.starts_run = survey.starts_run;
  result.starts_failed = survey.starts_failed;
  result.starts_agreeing = survey.starts_agreeing;
  result.waterfall = survey.waterfall;
  return result;
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

namespace {

Threshold threshold_of_search(Threshold threshold, const FitResult& result) {
  threshold.inflation = result.inflation;
  threshold.noise = result.noise;
  return threshold;
}

/// @param weighted the same as `function`, if it has priors or censored readings
FitResult fit_searched(const ExperimentResiduals& function, ExperimentResiduals* weighted) {
  const FitConfig& config = function.config();
  std::vector<FitParameter> parameters = searched_parameters(config);
  Threshold threshold{config.level, config.scale_known(),
                      function.value_count() + prior_count(config),
                      static_cast<int>(parameters.size())};
  threshold.least_variance = computed_variance(function);
  FitResult result = weighted != nullptr
                         ? balanced_search(*weighted, parameters, threshold)
                         : widened_search(function, parameters, threshold, config.profiles, {});
  // A search that began at minima of a cheaper model says nothing of its starts.
  Confirmation confirmation;
  if (function.surrogate() == nullptr && config.profiles) {
    confirmation = confirm(result, function, parameters, threshold_of_search(threshold, result));
  }
  if (confirmation.deeper) {
    result = widened_search(function, parameters, threshold, config.profiles,
                            {{*confirmation.deeper, result.best.natural}, {1, 1}});
    confirmation.found = 1;
  }
  threshold = threshold_of_search(threshold, result);
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
  mark_not_separable(result);
  mark_unconfirmed(result, confirmation);
  mark_conditions(result, function);
  add_flags(result, function);
  return result;
}

}  // namespace

namespace {

FitResult fit_with_priors(const ExperimentResiduals& function) {
  if (prior_count(function.config()) == 0 && !function.has_censored()) {
    return fit_searched(function, nullptr);
  }
  const std::unique_ptr<ExperimentResiduals> weighted = function.copy();
  return fit_searched(*weighted, weighted.get());
}

}  // namespace

FitResult fit_experiments(const ExperimentResiduals& function) {
  constexpr int kMostRounds = 5;
  const FitResult of_all = fit_with_priors(function);
  FitResult result = of_all;
  std::vector<std::size_t> outliers;
  for (int round = 0; round <= kMostRounds; ++round) {
    std::vector<std::size_t> found = isolated_outliers(function, result.best.natural);
    if (found == outliers) {
      if (!outliers.empty())
        result.remarks.push_back({"outliers_left_out", outlier_words(function, outliers)});
      return result;
    }
    outliers = std::move(found);
    const std::unique_ptr<ExperimentResiduals> others = function.copy();
    others->leave_out(outliers);
    result = fit_with_priors(*others);
  }
  return of_all;  // what lies far off depends on what is left out: nothing is
}

Threshold threshold_of(const FitResult& fit) {
  Threshold threshold{fit.config.level, fit.config.scale_known(),
                      fit.value_count + prior_count(fit.config),
                      static_cast<int>(fit.parameters.size()), fit.inflation};
  threshold.noise = fit.noise;
  threshold.least_variance = fit.least_variance;
  return threshold;
}

}  // namespace tpm::fit
