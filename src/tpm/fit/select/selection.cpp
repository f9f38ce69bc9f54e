#include "tpm/fit/select/selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/recording/unseen_rises.hpp"
#include "tpm/fit/select/channel_cause.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/fit/select/gate.hpp"
#include "tpm/fit/select/law_choice.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpm/fit/select/untold_noise.hpp"
#include "tpm/work/give_up.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// Residuals of a fit, one run for each recording, in the order of time.
std::vector<std::vector<double>> standardised_runs(const FitResult& fit) {
  return mapped<std::vector<double>>(fit.recordings, [](const RecordingFit& r) {
    std::vector<double> run;
    run.reserve(r.observed.size());
    for (std::size_t i = 0; i < r.observed.size(); ++i) {
      if (r.fitted[i]) run.push_back(r.standardised[i]);
    }
    return run;
  });
}

Correlation correlation_of(const FitResult& fit) {
  const auto runs = standardised_runs(fit);
  const std::vector<std::span<const double>> views(runs.begin(), runs.end());
  return residual_correlation(views);
}

/// Fewer samples than these say nothing about a prediction.
constexpr int kFewestPredicted = 5;

double rms_over_peak(const FitResult& fit) {
  double worst = 0.0;
  for (const RecordingFit& r : fit.recordings) worst = std::max(worst, r.rms_residual / r.peak);
  return worst;
}

}  // namespace

Candidate fit_candidate(const FitConfig& config, const std::vector<DataSet>& data,
                        bool refusal_counts) {
  Candidate candidate;
  candidate.law = config.law.value();
  candidate.parameters = static_cast<int>(config.parameters.size()) + 1;  // and the noise's size
  try {
    candidate.fit = run_fit(config, data);
  } catch (const Error& error) {
    const bool of_law = refusal_counts && error.code() == ExitCode::bad_input;
    if (error.code() != ExitCode::numerical && !of_law) throw;
    candidate.failed = true;
    candidate.identified = false;
    candidate.reason = error.what();
  }
  return candidate;
}

namespace {

Candidate fit_to_recordings(const LawSpec& law, std::span<const PreparedRecording> recordings,
                            const std::vector<DataSet>& data, SetupOptions setup) {
  setup.profiles = false;
  Candidate candidate = fit_candidate(recording_config(law, recordings, setup), data);
  if (candidate.failed) return candidate;
  candidate.rms_over_peak = rms_over_peak(candidate.fit);
  const ProtocolSpans spans = protocol_spans(recordings);
  judge_identified(candidate, spans);
  return candidate;
}

/// The smallest deviance that counts: residuals at rounding level are all the same to us.
double floored_deviance(const Candidate& c, int samples) {
  return std::max(
      {c.fit.best.deviance, c.fit.least_variance * samples, std::numeric_limits<double>::min()});
}

void score(Candidate& c, int samples, double effective, bool few_readings) {
  const double k = c.parameters;
  const double log_likelihood = effective * std::log(floored_deviance(c, samples) / samples);
  const double spare = std::max(effective - k - 1.0, 1e-3);
  c.aicc = log_likelihood + 2.0 * k + 2.0 * k * (k + 1.0) / spare;
  // McQuarrie's small-sample form, whose n - p - 2 counts no noise. Half a reading is the least
  // that is left over: so a law through every reading has to be much nearer than one beside them.
  constexpr double kLeastSpare = 0.5;
  const double share = few_readings ? effective / std::max(effective - k - 1.0, kLeastSpare) : 1.0;
  c.bic = log_likelihood + k * std::log(effective) * share;
}

}  // namespace

bool plateau_is_not_told(const FitResult& fit) {
  for (const ParameterResult& p : fit.parameters) {
    if (p.parameter.name != "k_inf") continue;
    return p.at_lower_bound || (p.standard_error && p.estimate < 2.0 * *p.standard_error);
  }
  return false;
}

namespace {

/// Where the lasting stiffness is not told from 0, the law without it is a lesser one.
void add_laws_without_plateau(Selection& s, std::span<const PreparedRecording> recordings,
                              const std::vector<DataSet>& data, const SelectionOptions& options) {
  if (options.only_listed) return;
  const std::size_t fitted = s.candidates.size();
  for (std::size_t i = 0; i < fitted; ++i) {
    const Candidate& c = s.candidates[i];
    LawSpec fluid = c.law;
    fluid.solid = false;
    const bool possible = !c.failed && c.law.branches > 0 && c.law.form == BranchForm::parallel &&
                          c.law.fractional == Fractional::none && plateau_is_not_told(c.fit);
    if (possible) s.candidates.push_back(fit_to_recordings(fluid, recordings, data, options.setup));
  }
}

/// Fits the material to some recordings and predicts another, whose nuisance parameters alone are
/// fitted to it.
HeldOut predict_one(const Candidate& candidate, std::span<const PreparedRecording> recordings,
                    std::size_t left_out, SetupOptions setup) {
  std::vector<PreparedRecording> others;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    if (i != left_out) others.push_back(recordings[i]);
  }
  setup.profiles = false;
  const FitResult fit = run_fit(recording_config(candidate.law, others, setup), data_sets(others));
  HeldOut held;
  held.what = recordings[left_out].name;
  const FitResult prediction = fit_placement(
      candidate.law, model_parameters(fit.config, fit.best.natural, 0), recordings[left_out], setup,
      has_own_slack(candidate.fit.config) ? FittedPlacement::slack_too
                                          : FittedPlacement::offset_or_contact);
  const RecordingFit& r = prediction.recordings.front();
  held.rms = r.rms_residual;
  held.rms_over_peak = r.rms_residual / r.peak;
  held.rms_standardised = std::sqrt(prediction.chi_square / prediction.value_count);
  held.rms_if_fitted = candidate.fit.recordings[left_out].rms_residual;
  return held;
}

/// The second half of the hold, predicted from everything before.
/// Nothing if it has too few samples to tell a prediction from another.
std::optional<HeldOut> predict_second_half(const Candidate& candidate,
                                           const PreparedRecording& recording, SetupOptions setup) {
  PreparedRecording early = recording;
  double hold_begin = recording.from_s;
  bool loaded = false;  // the rest before the ramp is no hold
  for (const Phase& phase : recording.phases.phases) {
    const double begin = recording.recording.time_s[phase.first];
    if (phase.kind == PhaseKind::loading && !loaded) hold_begin = std::max(hold_begin, begin);
    loaded = loaded || phase.kind == PhaseKind::loading;
    if (phase.kind == PhaseKind::hold && loaded && begin < recording.to_s) hold_begin = begin;
  }
  early.to_s = 0.5 * (hold_begin + recording.to_s);
  setup.profiles = false;
  const std::span<const PreparedRecording> one(&early, 1);
  const FitResult fit = run_fit(recording_config(candidate.law, one, setup), data_sets(one));
  const RecordingFit& r = fit.recordings.front();
  HeldOut held;
  held.what = fmt::format("{}: the second half of the hold", recording.name);
  double sum = 0.0;
  double sum_fitted = 0.0;
  int count = 0;
  const RecordingFit& whole = candidate.fit.recordings.front();
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (r.time_s[i] <= early.to_s || r.time_s[i] > recording.to_s || whole.is_censored(i)) continue;
    sum += std::pow(r.predicted[i] - r.observed[i], 2);
    sum_fitted += std::pow(whole.predicted[i] - whole.observed[i], 2);
    ++count;
  }
  if (count < kFewestPredicted) return std::nullopt;
  held.rms = std::sqrt(sum / count);
  held.rms_over_peak = held.rms / whole.peak;
  held.rms_if_fitted = std::sqrt(sum_fitted / count);
  return held;
}

void hold_out(Candidate& c, std::span<const PreparedRecording> recordings,
              const SelectionOptions& options) {
  if (c.failed) return;
  // Coefficients go from one recording to another only at one reference depth.
  SetupOptions setup = options.setup;
  setup.reference = c.law.reference;
  const std::string failure = gave_up([&] {
    if (recordings.size() == 1) {
      const auto held = predict_second_half(c, recordings.front(), setup);
      if (held) c.held_out.push_back(*held);
    } else {
      for (std::size_t i = 0; i < recordings.size(); ++i) {
        c.held_out.push_back(predict_one(c, recordings, i, setup));
      }
    }
  });
  if (failure.empty()) return;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  c.held_out.push_back({"failed: " + failure, kInfinity, kInfinity, kInfinity, 0.0});
}

/// Error of each law at recording i when fitted to the others. No verdict: that takes the
/// uncertainty of the prediction, which tpm validate counts.
void describe_prediction(Selection& s, std::size_t i) {
  std::vector<std::string> errors;
  for (const Candidate& c : s.candidates) {
    if (c.failed || i >= c.held_out.size()) continue;
    const HeldOut& h = c.held_out[i];
    errors.push_back(
        fmt::format("{} {} %", law_name(c.law), significant(100.0 * h.rms_over_peak, 3)));
  }
  s.summary.push_back(fmt::format("{} predicted from the others, rms over peak: {}",
                                  s.candidates.front().held_out[i].what, fmt::join(errors, ", ")));
}

void describe(Selection& s) {
  const Candidate& chosen = s.candidates[s.recommended];
  const Candidate& best = s.candidates[s.best_bic];
  const std::optional<LawAdequacy>& adequacy = chosen.fit.adequacy;
  if (adequacy && adequacy->is_rejected()) s.summary.push_back(adequacy->summary);
  s.recommendation = s.summary.size();
  s.summary.push_back(fmt::format("{} {} ({}): {} parameters, rms residual {} % of the peak",
                                  least_law_words(s, "the data"), law_name(chosen.law),
                                  law_words(chosen.law), chosen.parameters - 1,
                                  significant(100.0 * chosen.rms_over_peak, 3)));
  if (adequacy && !adequacy->is_rejected()) s.summary.push_back(adequacy->summary);
  if (s.recommended != s.best_bic && !s.preferred) {
    s.summary.push_back(fmt::format(
        "{} has the lowest BIC, by {}, {}", law_name(best.law), significant(chosen.delta_bic, 3),
        best.identified || chosen.unloading_refutes
            ? fmt::format("less than the margin of {}", significant(s.margin, 3))
            : "but is not identified: " + best.reason));
  }
  for (std::size_t i = 0; i < best.held_out.size() && best.held_out.size() > 1; ++i) {
    describe_prediction(s, i);
  }
  if (s.correlation.significant) {
    s.summary.push_back(fmt::format(
        "residuals repeat each other: {} samples count as {} readings (lag-1 correlation {})",
        s.samples, significant(s.effective_count, 3), significant(s.correlation.lag1, 2)));
  }
}

/// An imposed load that elastic tension helps to carry leaves no closed form: each interval between
/// two samples is solved for itself, which takes longer than all other laws of the family together.
void leave_out_stepped_creep(std::vector<LawSpec>& laws, Selection& s,
                             std::span<const PreparedRecording> recordings) {
  constexpr std::size_t kMostStepped = 100;  // samples; those of a second or two of computing
  std::size_t samples = 0;
  for (const PreparedRecording& r : recordings) {
    if (is_load_imposed(r.recording)) samples += r.recording.time_s.size();
  }
  if (samples <= kMostStepped) return;
  std::vector<std::string> names;
  std::erase_if(laws, [&names](const LawSpec& law) {
    const bool stepped = law.tension != Tension::none && law.branches > 0;
    if (stepped) names.push_back(law_name(law));
    return stepped;
  });
  if (names.empty()) return;
  const std::string listed = fmt::format("{}", fmt::join(names, ","));
  s.remarks.push_back(
      {"laws_not_tried",
       fmt::format(
           "not tried: {}, which take longest where a load is imposed; --laws {} tries them",
           listed, listed)});
}

}  // namespace

std::vector<LawSpec> classical_family() {
  std::vector<LawSpec> laws;
  for (const Kernel kernel : {Kernel::linear, Kernel::hertz, Kernel::power}) {
    for (int branches = 0; branches <= 3; ++branches) {
      laws.push_back({.kernel = kernel, .branches = branches});
    }
  }
  for (int branches = 0; branches <= 3; ++branches) {
    laws.push_back({.branches = branches, .tension = Tension::elastic});
    if (branches > 0) laws.push_back({.branches = branches, .tension = Tension::relaxing});
  }
  return laws;
}

std::vector<LawSpec> fractional_family() {
  std::vector<LawSpec> laws;
  for (const Kernel kernel : {Kernel::linear, Kernel::hertz, Kernel::power}) {
    for (const Fractional fractional : {Fractional::springpot, Fractional::maxwell,
                                        Fractional::kelvin_voigt, Fractional::zener}) {
      laws.push_back({.kernel = kernel, .branches = 0, .fractional = fractional});
    }
  }
  return laws;
}

std::size_t least_within(const std::vector<Candidate>& candidates, double margin) {
  std::optional<std::size_t> chosen;
  // If no law is identified, one whose times the protocol could show goes before one that only
  // fits.
  enum class Eligible { identified, not_contradicted, all };
  // What the unloading alone speaks against gives way to a law that describes the loading as well.
  const bool refuted = std::ranges::any_of(candidates, [](const Candidate& c) {
    return !c.failed && c.delta_bic == 0.0 && c.unloading_refutes;
  });
  const double farthest = refuted ? kDecisiveBic : std::numeric_limits<double>::infinity();
  for (const Eligible which : {Eligible::identified, Eligible::not_contradicted, Eligible::all}) {
    const auto eligible = [&](const Candidate& c) {
      return !c.failed && c.delta_bic <= farthest &&
             (c.identified || which == Eligible::all ||
              (which == Eligible::not_contradicted && !c.contradicted));
    };
    double best = std::numeric_limits<double>::infinity();
    for (const Candidate& c : candidates) {
      if (eligible(c)) best = std::min(best, c.delta_bic);
    }
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const Candidate& c = candidates[i];
      if (!eligible(c) || c.delta_bic - best > margin) continue;
      if (!chosen || c.parameters < candidates[*chosen].parameters) chosen = i;
    }
    if (chosen) return *chosen;
  }
  throw Error(ExitCode::numerical, "selection", "no law could be fitted");
}

void rank_candidates(Selection& s, bool few_readings) {
  double best_aicc = std::numeric_limits<double>::infinity();
  double best_bic = best_aicc;
  for (Candidate& c : s.candidates) {
    if (c.failed) continue;
    score(c, s.samples, s.effective_count, few_readings);
    best_aicc = std::min(best_aicc, c.aicc);
    best_bic = std::min(best_bic, c.bic);
  }
  for (Candidate& c : s.candidates) {
    c.delta_aicc = c.aicc - best_aicc;
    c.delta_bic = c.bic - best_bic;
  }
  std::ranges::stable_sort(s.candidates, [](const Candidate& a, const Candidate& b) {
    if (a.failed != b.failed) return b.failed;
    return a.bic < b.bic;
  });
  s.recommended = least_within(s.candidates, s.margin);
}

namespace {

/// The laws to try: those that were asked for, or the classical family where it makes sense.
std::vector<LawSpec> family_to_try(std::span<const PreparedRecording> recordings,
                                   const SelectionOptions& options) {
  std::vector<LawSpec> laws = options.laws.empty() ? classical_family() : options.laws;
  if (options.only_listed || recordings.empty()) return laws;
  const Quantity drive = law_drive(recordings.front().recording);
  if (!is_answered_by_stress(drive)) return laws;
  // Hertz is the contact of a ball, tension that of lateral neighbours.
  const bool strain = drive == Quantity::strain;
  std::erase_if(laws, [strain](const LawSpec& law) {
    return law.kernel == Kernel::hertz || (strain && law.tension != Tension::none);
  });
  return laws;
}

/// Samples, and how many of them are independent, from the law that comes closest: its residuals
/// are the nearest to noise alone. Throws Error(numerical) if no law could be fitted.
void count_samples(Selection& s, std::size_t laws) {
  const Candidate* closest = nullptr;
  for (const Candidate& c : s.candidates) {
    if (c.failed) continue;
    if (closest == nullptr || c.fit.best.deviance < closest->fit.best.deviance) closest = &c;
  }
  if (closest == nullptr) {
    throw Error(
        ExitCode::numerical, "selection",
        fmt::format("none of {} laws could be fitted: {}", laws, s.candidates.front().reason));
  }
  s.samples = closest->fit.value_count;
  s.correlation = correlation_of(closest->fit);
  s.effective_count = s.correlation.effective_count;
}

void predict_held_out(Selection& s, std::span<const PreparedRecording> recordings,
                      const SelectionOptions& options) {
  Progress predicting("predicting what was held out", s.candidates.size());
  for (Candidate& c : s.candidates) {
    hold_out(c, recordings, options);
    predicting.advance();
  }
  if (!s.candidates.front().held_out.empty()) return;
  s.remarks.push_back(
      {"nothing_held_out",
       fmt::format("nothing was held out: the second half of the hold has fewer than {} samples",
                   kFewestPredicted)});
}

/// Both answers of the recommended and the preferred law where a drift cannot be told from a slow
/// branch.
void add_drift_answers(Selection& s, std::span<const PreparedRecording> recordings) {
  FitResult& chosen = s.candidates[s.recommended].fit;
  s.drift = give_both_drift_answers(chosen, recordings);
  if (s.drift) chosen.remarks.push_back({"drift_not_separable", drift_words(*s.drift, chosen)});
  if (!s.preferred) return;
  FitResult& preferred = s.candidates[*s.preferred].fit;
  const auto both = give_both_drift_answers(preferred, recordings);
  if (both) preferred.remarks.push_back({"drift_not_separable", drift_words(*both, preferred)});
}

void add_remarks(Selection& s, std::span<const PreparedRecording> recordings) {
  const FitResult& chosen = s.candidates[s.recommended].fit;
  const auto warn = [&s](std::vector<Remark> more) {
    std::ranges::move(more, std::back_inserter(s.remarks));
  };
  warn(recording_remarks(recordings));
  warn(protocol_remarks(chosen, recordings));
  warn(outside_remarks(chosen));
}

/// What was done to the recordings before the fit.
void describe_recordings(Selection& s, std::span<const PreparedRecording> recordings,
                         const SelectionOptions& options) {
  for (const PreparedRecording& r : recordings) {
    if (!r.start_up.empty()) s.summary.push_back(r.start_up);
    if (std::string rises = unseen_rise_words(r); !rises.empty()) s.summary.push_back(rises);
    if (options.setup.contact) continue;
    std::string jump = contact_in_jump_words(r, s.candidates[s.recommended].fit.config);
    if (!jump.empty()) s.summary.push_back(std::move(jump));
  }
}

}  // namespace

Selection select_law(std::span<const PreparedRecording> recordings,
                     const SelectionOptions& wanted) {
  SelectionOptions options = wanted;
  options.setup.placements = std::make_shared<PlacementMemory>();
  std::vector<LawSpec> laws = family_to_try(recordings, options);
  const std::vector<DataSet> data = data_sets(recordings);
  Selection s;
  s.margin = options.margin;
  if (options.laws.empty()) leave_out_stepped_creep(laws, s, recordings);
  Progress progress("fitting laws", laws.size());
  for (const LawSpec& law : laws) {
    s.candidates.push_back(fit_to_recordings(law, recordings, data, options.setup));
    progress.advance();
  }
  add_laws_without_plateau(s, recordings, data, options);
  count_samples(s, laws.size());
  rank_candidates(s);
  judge_unloading(s, recordings, options.setup);
  if (options.held_out) predict_held_out(s, recordings, options);
  const auto with_profiles = [&](const LawSpec& law) {
    return run_fit(recording_config(law, recordings, options.setup), data);
  };
  settle_choice(s, protocol_spans(recordings),
                options.setup.profiles ? ProfiledFit(with_profiles) : nullptr);
  if (options.drift_answers) add_drift_answers(s, recordings);
  for (const auto i : {std::optional(s.recommended), s.preferred}) {
    if (i) doubt_plateau(s.candidates[*i].fit, protocol_spans(recordings));
  }
  add_remarks(s, recordings);
  state_adequacy(s, recordings);
  Candidate& chosen = s.candidates[s.recommended];
  if (doubt_untold_noise(chosen.fit)) {
    chosen.identified = false;
    chosen.reason = "the noise is not told";
  }
  name_channel_cause(s, recordings, options.setup);
  describe(s);
  describe_recordings(s, recordings, options);
  keep_choice(s);
  return s;
}

}  // namespace tpm::fit
