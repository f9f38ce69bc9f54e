#include "tpm/fit/design/recovery.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "tpm/base/lists.hpp"
#include "tpm/base/random.hpp"
#include "tpm/base/text.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

constexpr double kRequired = 0.95;       // of the trials: the right law, and none that is larger
constexpr double kIntervalLevel = 0.95;  // of the intervals

/// Appends moments from `from_s` (left out) to `to_s`, which is always one of them.
void append_times(std::vector<double>& times, double from_s, double to_s, double interval_s) {
  const auto steps = static_cast<int>(std::ceil((to_s - from_s) / interval_s - 1e-9));
  for (int i = 1; i <= steps; ++i) times.push_back(std::min(from_s + i * interval_s, to_s));
}

double visible_value(const LawParameter& p, int branches, double order) {
  constexpr double kStiffness = 200.0;  // N/m: about a newton at 5 mm
  static const std::vector<std::vector<double>> times_s = {{}, {2.0}, {0.5, 5.0}, {0.3, 2.0, 12.0}};
  if (p.preset) return *p.preset;
  if (p.name == "alpha") return order;
  if (p.name == "beta") return 0.25 * order;
  if (p.name == "exponent") return 2.2;
  if (p.name == "tension_share") return 0.5;
  if (p.dimension != Dimension::time) return kStiffness;
  if (branches == 0) return 2.0;
  const auto place =
      static_cast<std::size_t>(std::stoi(p.name.substr(p.name.find_first_of("0123456789"))) - 1);
  const auto count = static_cast<std::size_t>(branches);
  if (count < times_s.size()) return times_s[count][place];
  return 0.2 * std::pow(60.0, static_cast<double>(place) / (branches - 1));
}

/// Data shared by the trials of one law.
struct Trials {
  LawSpec law;
  std::vector<double> true_values;
  Recording clean;
  double sigma = 0.0;
};

Recording scattered(const Trials& trials, Random& random) {
  Recording recording = trials.clean;
  for (double& force : recording.response) force += trials.sigma * random.normal();
  return recording;
}

/// True if the fitted curve stays within one sigma of the true curve over the whole record.
bool predicts_true_curve(const FitResult& fit, const Trials& trials) {
  const std::vector<double>& predicted = fit.recordings.front().predicted;
  return std::equal(predicted.begin(), predicted.end(), trials.clean.response.begin(),
                    [&](double fitted, double true_values) {
                      return std::abs(fitted - true_values) < trials.sigma;
                    });
}

/// Why a candidate was not recommended: what is not identified in it, or its BIC.
std::string reason_against(const Candidate& candidate, double margin) {
  if (candidate.failed || !candidate.identified) return candidate.reason;
  return candidate.delta_bic > margin ? "another law has a lower BIC by more than the margin"
                                      : "a law with no more parameters is within the margin of BIC";
}

void count_choice(const Selection& selection, const Trials& trials, ChoiceCount& count) {
  const Candidate& chosen = selection.candidates[least_within(selection.candidates, count.margin)];
  const std::string true_values = law_name(trials.law);
  const std::string name = law_name(chosen.law);
  ++count.chosen[name];
  const auto generating = std::ranges::find_if(
      selection.candidates, [&](const Candidate& c) { return law_name(c.law) == true_values; });
  if (name == true_values) {
    ++count.returned;
  } else if (predicts_true_curve(chosen.fit, trials)) {
    ++count.equivalent;
  }
  if (generating == selection.candidates.end()) return;
  if (chosen.parameters > generating->parameters) ++count.larger;
  if (name != true_values) ++count.reasons[reason_against(*generating, count.margin)];
}

/// The residuals of the generating law, with the reference depth of the true law so that its
/// parameters mean the same.
ExperimentResiduals generating_residuals(const PreparedRecording& recording, const Trials& trials,
                                         SetupOptions setup) {
  setup.profiles = false;
  const std::span<const PreparedRecording> one(&recording, 1);
  FitConfig config = recording_config(trials.law, one, setup);
  config.law->reference = trials.law.reference;
  return {config, data_sets(one)};
}

/// The estimated parameters at the true values; the nuisance ones, which belong to the simulated
/// test, are 0 there.
std::vector<double> true_estimates(const FitResult& fit, const Trials& trials) {
  const LawModel model(trials.law);
  return mapped<double>(fit.config.parameters, [&](const EstimatedParameter& p) {
    // A drift of the zero and a delayed rise belong to the test, too, and are none of the law.
    return p.drift || p.rise ? 0.0 : trials.true_values[model.index(p.fit.name)];
  });
}

/// Counts which profile-likelihood intervals contain the true value.
void count_intervals(const ExperimentResiduals& function, const Trials& trials,
                     RecoveryResult& result) {
  const FitResult fit = fit_experiments(function);
  const auto parameters = mapped<FitParameter>(fit.parameters, &ParameterResult::parameter);
  const std::vector<double> true_values = true_estimates(fit, trials);
  const std::vector<std::vector<double>> starts{fit.best.natural, true_values};
  // Priors weigh as much as they did in the fit.
  const std::unique_ptr<ExperimentResiduals> weighted = function.copy();
  weighted->set_prior_weight(std::max(std::sqrt(fit.inflation * fit.variance_factor), 1e-12));
  std::vector<double> deviance;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    deviance.push_back(profile_deviance(*weighted, parameters, starts, i, true_values[i]));
  }
  const double least = std::min(fit.best.deviance, *std::ranges::min_element(deviance));
  // The search ends within 1e-4 standard deviations of a minimum.
  constexpr double kDeeper = 1e-3;
  if (least < fit.best.deviance * (1.0 - kDeeper / fit.value_count)) ++result.missed;
  Threshold threshold = threshold_of(fit);
  threshold.level = kIntervalLevel;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    for (ParameterCoverage& coverage : result.parameters) {
      const bool held = deviance[i] - least <= threshold.rise_of(i, least);
      if (coverage.name == parameters[i].name && held) ++coverage.covered;
    }
  }
}

void run_trial(const Trials& trials, const SelectionOptions& options, Random& random,
               RecoveryResult& result) {
  Recording simulated = scattered(trials, random);
  ++result.trials;
  for (ChoiceCount& count : result.choices) ++count.trials;
  try {
    const PreparedRecording recording = prepare_recording("simulated", std::move(simulated));
    count_intervals(generating_residuals(recording, trials, options.setup), trials, result);
    const Selection selection = select_law(std::span(&recording, 1), options);
    for (ChoiceCount& count : result.choices) count_choice(selection, trials, count);
  } catch (const Error& error) {
    if (error.code() != ExitCode::numerical && error.code() != ExitCode::bad_input) throw;
    ++result.failed;
  }
}

std::string coverage_text(const std::vector<ParameterCoverage>& parameters, int trials) {
  return listed(parameters, [&](const ParameterCoverage& p) {
    return fmt::format("{} {:.1f}{}", p.name, 100.0 * p.covered / trials,
                       p.p_value < 0.001 ? "!" : "");
  });
}

/// The laws that were returned instead, most frequent first.
std::string others_text(const ChoiceCount& c, const std::string& true_values) {
  std::vector<std::pair<int, std::string>> others;
  for (const auto& [name, count] : c.chosen) {
    if (name != true_values) others.emplace_back(-count, name);
  }
  std::sort(others.begin(), others.end());
  return listed(others,
                [](const auto& other) { return fmt::format("{} {}", -other.first, other.second); });
}

}  // namespace

Recording simulated_recording(const LawSpec& law, std::span<const double> parameters,
                              const SimulatedTest& test) {
  const double start_s = -test.approach_m / test.rate_m_per_s;
  const double ramp_s = test.depth_m / test.rate_m_per_s;
  Recording recording;
  recording.header.id = law_name(law);
  recording.time_s = {start_s};
  append_times(recording.time_s, start_s, ramp_s, test.ramp_interval_s);
  append_times(recording.time_s, ramp_s, ramp_s + test.hold_s, test.hold_interval_s);
  for (const double t : recording.time_s) {
    recording.drive.push_back(std::min(t * test.rate_m_per_s, test.depth_m));
  }
  Protocol history = measured_history(Drive::displacement, recording.time_s, recording.drive);
  history.set_equilibrium_at_start(true);
  const Response response =
      LawModel(law).respond(history, recording.time_s, parameters, Want::values);
  recording.response.assign(response.value.begin(), response.value.end());
  return recording;
}

std::vector<double> visible_parameters(const LawSpec& law, double order) {
  return mapped<double>(law_parameters(law), [&](const LawParameter& p) {
    return visible_value(p, law.branches, order);
  });
}

bool RecoveryResult::fulfilled() const {
  return std::ranges::all_of(choices, [](const ChoiceCount& c) { return c.fulfilled(); });
}

bool ChoiceCount::fulfilled() const {
  return right() >= kRequired * trials && larger <= (1.0 - kRequired) * trials;
}

RecoveryResult recover(const LawSpec& law, std::span<const double> true_values,
                       const RecoveryOptions& options) {
  Trials trials{law, {true_values.begin(), true_values.end()}, {}, 0.0};
  trials.law.reference = options.test.depth_m;
  trials.clean = simulated_recording(trials.law, true_values, options.test);
  trials.sigma = options.noise * std::ranges::max(trials.clean.response);
  SelectionOptions selection = options.selection;
  selection.held_out = false;
  selection.setup.profiles = false;

  RecoveryResult result;
  result.law = trials.law;
  result.true_values = trials.true_values;
  result.noise = options.noise;
  result.seed = options.seed;
  std::vector<double> margins = options.margins;
  if (margins.empty()) margins.push_back(selection.margin);
  for (const double margin : margins) result.choices.emplace_back().margin = margin;
  for (const LawParameter& p : law_parameters(law)) {
    if (!p.nuisance && !p.preset) result.parameters.push_back({p.name, 0, 0, 1.0});
  }
  Random random(options.seed);
  Progress progress(law_name(law), static_cast<std::size_t>(options.trials));
  for (int i = 0; i < options.trials; ++i) {
    run_trial(trials, selection, random, result);
    progress.advance();
  }
  for (ParameterCoverage& p : result.parameters) {
    p.p_value = binomial_test(p.covered, result.trials, kIntervalLevel);
  }
  return result;
}

namespace {

Json choice_json(const ChoiceCount& c) {
  return {{"margin_bic", c.margin}, {"returned", c.returned},     {"equivalent", c.equivalent},
          {"larger", c.larger},     {"fulfilled", c.fulfilled()}, {"chosen", c.chosen},
          {"reasons", c.reasons}};
}

}  // namespace

Json to_json(const RecoveryResult& r) {
  Json j{{"law", law_name(r.law)}, {"noise_over_peak", r.noise}, {"seed", r.seed},
         {"trials", r.trials},     {"failed", r.failed},         {"missed_minimum", r.missed}};
  j["choices"] = array_json(r.choices, choice_json);
  Json list = Json::array();
  const LawModel model(r.law);
  for (const ParameterCoverage& p : r.parameters) {
    list.push_back({{"name", p.name},
                    {"true_SI", r.true_values[model.index(p.name)]},
                    {"covered", p.covered},
                    {"binomial_p_value", rounded(p.p_value)}});
  }
  j["parameters"] = std::move(list);
  return j;
}

std::string to_terminal_text(std::span<const RecoveryResult> results) {
  std::string text = fmt::format("{:<20} {:>6} {:>6} {:>8} {:>6} {:>6} {:>6}  {}\n", "law",
                                 "margin", "trials", "returned", "equiv.", "larger", "failed",
                                 "95 % intervals that hold the true value, % | returned instead");
  for (const RecoveryResult& r : results) {
    for (const ChoiceCount& c : r.choices) {
      const bool first = &c == r.choices.data();
      text +=
          fmt::format("{:<20} {:>6} {:>6} {:>8} {:>6} {:>6} {:>6}{} {} | {}\n", law_name(r.law),
                      shortest(c.margin), c.trials, c.returned, c.equivalent, c.larger, r.failed,
                      c.fulfilled() ? " " : "!", first ? coverage_text(r.parameters, r.trials) : "",
                      others_text(c, law_name(r.law)));
    }
  }
  text +=
      "!  below 95 % right (returned or equivalent), above 5 % larger, or a coverage that\n"
      "   differs from 95 % at the 0.1 % level (exact binomial test)\n";
  return text;
}

}  // namespace tpm::fit
