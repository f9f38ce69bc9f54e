#include "tpm/fit/select/fit_adequacy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <utility>

#include "tpm/base/distributions.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/recording/carried_noise.hpp"
#include "tpm/fit/recording/motion_before_load.hpp"
#include "tpm/fit/recording/repeated_readings.hpp"
#include "tpm/fit/select/configuration_remarks.hpp"
#include "tpm/fit/select/doubtful_contact.hpp"
#include "tpm/fit/select/doubtful_zero.hpp"
#include "tpm/fit/select/gate.hpp"
#include "tpm/fit/select/history_before_window.hpp"
#include "tpm/fit/select/law_choice.hpp"
#include "tpm/fit/select/reading_scatter.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/select/unloading_test.hpp"
#include "tpm/fit/select/untold_noise.hpp"
#include "tpm/fit/spikes_at_rest.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::fit {
namespace {

/// A verdict on one recording's readings at rest, or on the noise that was stated.
struct Judged {
  Adequacy adequacy;
  std::optional<std::size_t> choice;  ///< the recording; none: all data together
  bool noise_was_stated = false;
  std::string drift_off = {};  ///< what its drift is beside that of the rests, if they disagree
};

/// Order of what must be said: rejected before not judged before adequate, then by the ratio.
std::pair<int, double> rank(const Judged& judged) {
  const Adequacy& a = judged.adequacy;
  const int first = a.described == Described::not_described ? 2
                    : a.described == Described::not_judged  ? 1
                                                            : 0;
  return {first, a.residual_over_noise};
}

/// A recording and where its rest ends.
struct RestedRecording {
  const Recording* recording = nullptr;
  std::size_t at_rest = 0;
};

/// Where the drive first comes near its largest value, among the fitted samples.
double ramp_end_s(const RecordingFit& fit) {
  constexpr double kNear = 0.99;  // of the travel
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (std::size_t i = 0; i < fit.time_s.size(); ++i) {
    if (!fit.fitted[i]) continue;
    low = std::min(low, fit.drive[i]);
    high = std::max(high, fit.drive[i]);
  }
  for (std::size_t i = 0; i < fit.time_s.size(); ++i) {
    if (fit.fitted[i] && fit.drive[i] - low >= kNear * (high - low)) return fit.time_s[i];
  }
  return 0.0;
}

Adequacy adequacy_of(const RecordingFit& fit, const RestedRecording& rested, int parameters,
                     double level) {
  const Recording& r = *rested.recording;
  const std::size_t end = std::min(rested.at_rest, r.time_s.size());
  std::vector<double> rest_time, rest, time, reading, residual;
  const std::vector<bool> spikes = spikes_at_rest(std::span(r.response).first(end));
  for (std::size_t i = 0; i < end; ++i) {
    if (spikes[i]) continue;
    rest_time.push_back(r.time_s[i]);
    rest.push_back(r.response[i]);
  }
  for (std::size_t i = 0; i < fit.time_s.size(); ++i) {
    if (!fit.fitted[i] || !std::isfinite(fit.predicted[i])) continue;
    time.push_back(fit.time_s[i]);
    reading.push_back(fit.observed[i]);
    residual.push_back(fit.observed[i] - fit.predicted[i]);
  }
  return judge_adequacy({rest_time, rest, time, reading, residual, parameters,
                         carried_variance(fit, r, end), ramp_end_s(fit), repeated_readings(r)},
                        level);
}

/// The drift of a recording that the fit takes, where it is further from what the rests show than
/// both uncertainties allow: what the law cannot follow then went into the drift. The difference of
/// independent noises has the sum of their variances; the weight of the rests makes it smaller.
/// @return empty if they agree, or if there is no such drift
std::string drift_off(const FitResult& fit, std::size_t choice, double level) {
  const double far = normal_quantile(1.0 - 0.5 * level);
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const EstimatedParameter& estimated = fit.config.parameters[i];
    const ParameterResult& p = fit.parameters[i];
    if (!estimated.drift || estimated.drift->choice != choice) continue;
    if (!estimated.prior || !p.standard_error) continue;
    const Prior& rests = *estimated.prior;
    if (std::abs(p.estimate - rests.mean) <= far * std::hypot(rests.sd, *p.standard_error))
      return {};
    return fmt::format("it takes a drift of {}, but the readings at rest show {} +- {}",
                       in_sized_unit(p, p.estimate), in_sized_unit(p, rests.mean),
                       in_sized_unit(p, rests.sd));
  }
  return {};
}

/// The zero of a force cell that still warms up: the rest bends by more than chance and noise.
std::string bend_of_rest(const RestedRecording& rested, double level) {
  constexpr double kStill = 1e-3;  // of the drive's range
  constexpr double kShare = 0.1;   // of the level of the other tests, which come first
  constexpr double kSeen = 1.0;    // noises
  const Recording& r = *rested.recording;
  const auto [low, high] = std::ranges::minmax_element(r.drive);
  const double still = kStill * (*high - *low);
  std::size_t end = 0;
  while (end < std::min(rested.at_rest, r.time_s.size()) &&
         std::abs(r.drive[end] - r.drive.front()) <= still) {
    ++end;
  }
  const auto bend = rest_bend(std::span(r.time_s).first(end), std::span(r.response).first(end));
  if (!bend || bend->noises < kSeen || bend->p_value >= kShare * level) return {};
  return fmt::format("its zero is curved at rest by {} noises, but the fit has a straight line",
                     times_text(bend->noises));
}

bool has_measured_drift(const FitResult& fit, std::size_t choice) {
  return std::ranges::any_of(fit.config.parameters, [&](const EstimatedParameter& p) {
    return p.prior && p.drift && p.drift->choice == choice;
  });
}

/// The recording that the law describes worst; so many fits share the level.
std::optional<Judged> worst_of(const FitResult& fit, std::span<const RestedRecording> rested,
                               std::size_t fits = 1) {
  std::optional<Judged> worst;
  const double level =
      kAdequacyLevel / static_cast<double>(std::max<std::size_t>(fit.recordings.size(), 1) * fits);
  for (const RecordingFit& r : fit.recordings) {
    if (rested[r.choice].recording == nullptr) continue;
    // Two tests share the level where a drift was measured.
    const double each = has_measured_drift(fit, r.choice) ? 0.5 * level : level;
    RestedRecording rest = rested[r.choice];
    const std::string moving = load_in_air(*rest.recording, rest.at_rest);
    if (!moving.empty()) rest.at_rest = still_samples(*rest.recording, rest.at_rest);
    Judged one{adequacy_of(r, rest, parameters_each(fit), each), r.choice};
    if (!moving.empty() && one.adequacy.described == Described::not_described) {
      one.adequacy.causes = {{"load_in_air", moving}};
    }
    one.drift_off = drift_off(fit, r.choice, each);
    const std::string bent = bend_of_rest(rested[r.choice], each);
    if (!bent.empty()) {
      one.drift_off = bent;
      one.adequacy.described = Described::not_described;
      one.adequacy.causes.push_back(
          {"drift_not_linear", "a drift of the zero that is not linear (a warm-up)"});
    } else if (!one.drift_off.empty()) {
      one.adequacy.described = Described::not_described;
      one.adequacy.causes.push_back(
          {"slow_branch", "a slow branch that the law does not have, or a drift that changes"});
    }
    if (!worst || rank(one) > rank(*worst)) worst = std::move(one);
  }
  return worst;
}

/// None of an indentation under an imposed force, whose probe comes nearer at rest.
std::size_t told_at_rest(const Recording& recording, const RecordingPhases& phases) {
  return samples_before_load(recording) > 0 ? 0 : samples_at_rest(phases);
}

std::vector<RestedRecording> rested(std::span<const PreparedRecording> recordings) {
  std::vector<RestedRecording> list;
  for (const PreparedRecording& r : recordings) {
    list.push_back({&r.recording, told_at_rest(r.recording, r.phases)});
  }
  return list;
}

/// The residuals against noise whose size the configuration states, bands that are missed among
/// them: of readings alone FitResult::chi_square_p. None if it is no normal law, or if nothing is
/// left to test.
std::optional<Judged> against_stated_noise(const FitResult& fit) {
  if (!fit.chi_square_p) return std::nullopt;
  double squares = 0.0, degrees = 0.0;
  for (const FittedDatum& d : fit.data) {
    if (d.datum.held_out) continue;
    squares += d.standardised * d.standardised;
    degrees += d.datum.value ? 1.0 : 0.0;
  }
  for (const RecordingFit& r : fit.recordings) {
    for (std::size_t i = 0; i < r.standardised.size(); ++i) {
      if (r.fitted[i]) squares += r.standardised[i] * r.standardised[i];
    }
    degrees += independent_samples(r);
  }
  degrees = std::max(degrees - static_cast<double>(fit.parameters.size()), 1.0);
  Judged judged{{}, std::nullopt, true, {}};
  Adequacy& a = judged.adequacy;
  a.residual_over_noise = std::sqrt(squares / fit.degrees_of_freedom);
  a.noise_sd = 1.0;
  a.p_value = chi_squared_tail(degrees * squares / fit.degrees_of_freedom, degrees);
  a.described = a.p_value < kAdequacyLevel ? Described::not_described : Described::adequate;
  return judged;
}

std::string times_the_noise(const Judged& judged) {
  if (!judged.drift_off.empty()) return judged.drift_off;
  const Adequacy& a = judged.adequacy;
  const std::string times = "residual " + times_text(a.residual_over_noise) + " times the noise ";
  if (!judged.noise_was_stated) return times + (a.noise_under_load ? "under load" : "at rest");
  return fmt::format("{}that is stated, p = {} is {} {} %", times, significant(a.p_value, 2),
                     a.p_value < kAdequacyLevel ? "below" : "not below", 100.0 * kAdequacyLevel);
}

/// "this recording", or which of several.
std::string subject(const FitResult& fit, const Judged& judged) {
  if (!judged.choice) return "these data";
  if (fit.config.data.size() == 1) return "this recording";
  return fmt::format("'{}'", fit.config.data[*judged.choice].dataset);
}

/// @param tried how many laws were fitted
/// @param other one of them that does describe the data
LawAdequacy stated(const FitResult& fit, const Judged& judged, std::size_t tried,
                   const std::optional<LawSpec>& other) {
  LawAdequacy result;
  const Adequacy& a = judged.adequacy;
  result.verdict = described_name(a.described);
  if (a.described == Described::not_judged) {
    result.summary =
        a.restless
            ? "adequacy cannot be judged: the readings before the load scatter by more than those "
              "under it do about the law: they are not at rest, and tell no noise"
            : "adequacy cannot be judged: too few samples at rest before the load to tell the "
              "noise";
    return result;
  }
  if (a.noise_sd > 0.0) result.residual_over_noise = a.residual_over_noise;
  if (a.described == Described::adequate) {
    result.summary =
        fmt::format("the law describes {}: {}{}", subject(fit, judged), times_the_noise(judged),
                    judged.noise_was_stated ? "" : not_after_fit(fit));
    return result;
  }
  const std::string law = fit.config.law ? law_name(*fit.config.law) : "the model";
  if (other) {
    result.summary = fmt::format("{} does not describe {}: {}; {} does", law, subject(fit, judged),
                                 times_the_noise(judged), law_name(*other));
  } else {
    result.summary = fmt::format("no law tried describes {}: {}{}", subject(fit, judged),
                                 times_the_noise(judged),
                                 tried == 1 ? fmt::format(" (only {} was tried)", law) : "");
  }
  result.causes = a.causes;
  if (!a.causes.empty()) {
    result.summary +=
        fmt::format("; likely cause: {}", fmt::join(remark_texts(a.causes), "; and "));
  }
  return result;
}

void add_condition(FitResult& fit, std::string_view words) {
  for (ParameterResult& p : fit.parameters) {
    p.only_if_described = true;
    p.summary += words;
  }
}

void state(FitResult& fit, LawAdequacy adequacy) {
  if (adequacy.is_rejected()) {
    add_condition(fit, "; this supposes that the law describes the data, which it does not");
  }
  fit.adequacy = std::move(adequacy);
}

void state_of_rests(Selection& s, std::span<const PreparedRecording> recordings) {
  Candidate& chosen = s.candidates[s.recommended];
  const std::vector<RestedRecording> rests = rested(recordings);
  const auto worst = worst_of(chosen.fit, rests);
  if (!worst) return;
  const bool rejected = worst->adequacy.described == Described::not_described;
  std::optional<LawSpec> other;
  for (const Candidate& c : s.candidates) {
    if (!rejected || other || c.failed || &c == &chosen) continue;
    const auto its = worst_of(c.fit, rests);
    if (its && its->adequacy.described == Described::adequate) other = c.law;
  }
  const auto tried = static_cast<std::size_t>(
      std::ranges::count_if(s.candidates, [](const Candidate& c) { return !c.failed; }));
  LawAdequacy adequacy = stated(chosen.fit, *worst, tried, other);
  const bool springpots = std::ranges::any_of(
      s.candidates, [](const Candidate& c) { return c.law.fractional != Fractional::none; });
  if (rejected && !other && !springpots && tried > 1) {
    adequacy.summary += "; laws with spring-pots were not tried: --family fractional";
  }
  state(chosen.fit, std::move(adequacy));
  if (!rejected) return;
  chosen.identified = false;
  chosen.reason = "does not describe the data";
}

/// Of a law that the unloading refutes: it describes the loading alone.
LawAdequacy of_loading_alone(const FitResult& fit, const std::string& off) {
  LawAdequacy adequacy = fit.adequacy.value_or(LawAdequacy{});
  const std::string law = fit.config.law ? law_name(*fit.config.law) : "the model";
  adequacy.summary =
      adequacy.is_adequate() && adequacy.residual_over_noise
          ? fmt::format(
                "{} describes the loading of this recording (residual {} times the noise), "
                "but {}",
                law, times_text(*adequacy.residual_over_noise), off)
          : fmt::format("{} does not describe this recording: {}", law, off);
  adequacy.verdict = described_name(Described::not_described);
  adequacy.causes.push_back({"unloading_differs", off});
  return adequacy;
}

void state_refuted(Selection& s) {
  Candidate& chosen = s.candidates[s.recommended];
  if (!chosen.unloading_refutes) return;
  if (chosen.fit.adequacy && chosen.fit.adequacy->is_rejected()) return;
  LawAdequacy adequacy = of_loading_alone(chosen.fit, chosen.reason);
  const std::string other = law_of_unloading(s);
  adequacy.summary += !other.empty() ? "; " + other
                      : s.candidates.size() == 1
                          ? fmt::format(" (only {} was tried)", law_name(chosen.law))
                          : "; no law tried describes both";
  adequacy.summary += "; hold the depth, to see what relaxes";
  state(chosen.fit, std::move(adequacy));
  chosen.reason = "does not describe the unloading";
}

/// Without a hold relaxation is seen through the shape of the ramp alone: the unloading then tells
/// whether it is one.
void state_unloading(Selection& s, std::span<const PreparedRecording> recordings) {
  Candidate& chosen = s.candidates[s.recommended];
  if (chosen.fit.adequacy && chosen.fit.adequacy->is_rejected()) return;
  if (protocol_spans(recordings).hold_s > 0.0) return;
  // Where that refutes the closest law, this one was fitted to the unloading, too, and describes
  // it.
  if (s.candidates.front().unloading_refutes) return;
  const std::vector<UnloadingTest> tests = test_unloading(chosen.fit, data_sets(recordings));
  const auto worst = std::ranges::min_element(tests, {}, &UnloadingTest::p_value);
  if (worst == tests.end()) return;
  if (!(worst->p_value < kAdequacyLevel / static_cast<double>(tests.size()))) return;
  const std::string differs = fmt::format(
      "the unloading is not what this law predicts: off by {} % of the peak, {} times its "
      "uncertainty",
      significant(100.0 * worst->off_peak, 3), times_text(worst->times));
  LawAdequacy adequacy = chosen.fit.adequacy.value_or(LawAdequacy{});
  adequacy.verdict = described_name(Described::not_described);
  adequacy.summary =
      fmt::format("{} does not describe {}: {}; hold the depth, to see what relaxes",
                  law_name(chosen.law), subject(chosen.fit, {{}, worst->choice}), differs);
  adequacy.causes.push_back({"unloading_differs", differs});
  state(chosen.fit, std::move(adequacy));
  chosen.identified = false;
  chosen.reason = "does not describe the unloading";
}

}  // namespace

double independent_samples(const RecordingFit& fit) {
  constexpr double kSureness = 2.0, kMost = 0.98;
  const auto n = static_cast<double>(std::ranges::count(fit.fitted, true));
  if (!fit.correlation || n < 2.0) return n;
  const double r = fit.correlation->lag1;
  const double error = std::sqrt(std::max(1.0 - r * r, 0.05) / n);
  const double upper = std::clamp(r + kSureness * error, 0.0, kMost);
  return n * (1.0 - upper * upper) / (1.0 + upper * upper);
}

int parameters_each(const FitResult& fit) {
  const auto count = static_cast<int>(std::max<std::size_t>(fit.recordings.size(), 1));
  return (static_cast<int>(fit.parameters.size()) + count - 1) / count;
}

void state_hysteresis(FitResult& fit) {
  if (fit.adequacy && fit.adequacy->is_rejected()) return;
  const std::string off = hysteresis_of(fit);
  if (!off.empty()) state(fit, of_loading_alone(fit, off));
}

void state_as(FitResult& fit, const std::string& not_described) {
  LawAdequacy adequacy = fit.adequacy.value_or(LawAdequacy{});
  adequacy.verdict = described_name(Described::not_described);
  adequacy.summary = not_described;
  state(fit, std::move(adequacy));
}

void state_better(FitResult& fit, const std::string& law, const std::string& better, double by) {
  state_as(fit, fmt::format("{} does not describe these data: {} does better, by {} in BIC", law,
                            better, significant(by, 3)));
}

std::size_t samples_at_rest(const RecordingPhases& phases) {
  std::size_t end = 0;
  if (phases.contact_found && !phases.preloaded) {
    end = phases.contact_index;
  } else if (phases.phases.size() > 1 && phases.phases.front().kind == PhaseKind::hold) {
    end = phases.phases.front().last;
  }
  const std::size_t late = end / 10 + 2;
  return end > late ? end - late : 0;
}

void state_adequacy(FitResult& fit, std::span<const PreparedRecording> recordings,
                    std::size_t fits) {
  doubt_placement(fit, recordings);
  if (const auto worst = worst_of(fit, rested(recordings), fits)) {
    state(fit, stated(fit, *worst, 1, {}));
  }
  doubt_loading(fit);
}

void state_preferred(Selection& s) {
  if (!s.preferred) return;
  Candidate& chosen = s.candidates[s.recommended];
  if (chosen.fit.adequacy && chosen.fit.adequacy->is_rejected()) return;
  state_better(chosen.fit, law_name(chosen.law), law_name(s.candidates[*s.preferred].law),
               chosen.delta_bic);
  chosen.identified = false;
  chosen.reason = "does not describe the data";
}

void state_adequacy(Selection& s, std::span<const PreparedRecording> recordings) {
  for (const auto i : {std::optional(s.recommended), s.preferred}) {
    if (!i) continue;
    Candidate& c = s.candidates[*i];
    doubt_placement(c.fit, recordings);
    if (!doubt_history(c.fit, History::unread) || !c.identified) continue;
    c.identified = false;
    c.reason = "history before the window is not in the fit";
  }
  state_of_rests(s, recordings);
  state_preferred(s);
  state_refuted(s);
  state_unloading(s, recordings);
  for (const auto i : {std::optional(s.recommended), s.preferred}) {
    if (i) doubt_loading(s.candidates[*i].fit);
  }
}

void state_adequacy(FitResult& fit, const std::vector<DataSet>& data) {
  doubt_placement(fit, data);
  std::optional<Judged> judged = against_stated_noise(fit);
  if (!judged && !fit.recordings.empty()) {
    std::vector<RestedRecording> rests(data.size());
    for (const RecordingFit& r : fit.recordings) {
      const auto* recording = std::get_if<Recording>(&data[r.choice]);
      if (recording == nullptr || is_step_response(recording->response_quantity)) continue;
      PhaseOptions options;
      options.contact_response = fit.config.data[r.choice].contact_response;
      rests[r.choice] = {recording, told_at_rest(*recording, find_phases(*recording, options))};
    }
    judged = worst_of(fit, rests);
  }
  if (!judged) return;
  state(fit, stated(fit, *judged, 1, {}));
  doubt_untold_noise(fit);
}

FitResult fit_and_judge(const FitProblem& problem) {
  const std::vector<DataSet> data = problem.data.empty() ? load_data(problem.config) : problem.data;
  FitResult fit = run_fit(problem.config, data);
  give_both_drift_answers(fit, data);
  if (problem.data.empty()) doubt_history(fit, History::unread);
  doubt_history(fit, History::pulled);
  state_adequacy(fit, data);
  state_scatter(fit);
  repeat_choice(fit);
  doubt_loading(fit);
  std::vector<Remark> remarks = configuration_remarks(fit, data, problem.data.empty());
  fit.remarks.insert(fit.remarks.begin(), std::make_move_iterator(remarks.begin()),
                     std::make_move_iterator(remarks.end()));
  return fit;
}

}  // namespace tpm::fit
