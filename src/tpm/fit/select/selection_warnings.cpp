// Declared in tpm/fit/select/selection.hpp.
// Warnings of a selection on the samples outside the window, and on the protocol.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/verdict.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::fit {
namespace {

constexpr double kDescribesAfterFit = 3.0;  // times the residual inside the window
constexpr std::size_t kFewestOutside = 5;

/// The samples after the fitted part, and those of them that the law predicts.
struct Outside {
  double last_fitted_s = 0.0;
  std::size_t count = 0, predicted = 0;
  double sum_of_squares = 0.0;
  double turned_squares = 0.0;  ///< of it, where the response has the other sign
  double last_drive = 0.0;      ///< of the predicted ones
  double unknown_s = 0.0;       ///< from here on the law has no answer, if predicted < count
};

/// Where the fit begins, and the largest predicted response above or below that.
struct LoadedRange {
  double zero = 0.0, peak = 0.0;
};

LoadedRange loaded_range(const RecordingFit& r) {
  LoadedRange range;
  bool begun = false;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (!r.fitted[i] || !std::isfinite(r.predicted[i])) continue;
    if (!begun) range.zero = r.predicted[i];
    begun = true;
    const double rise = r.predicted[i] - range.zero;
    if (std::abs(rise) > std::abs(range.peak)) range.peak = rise;
  }
  return range;
}

Outside outside_of(const RecordingFit& r) {
  constexpr double kTurned = 0.02;  // of the peak
  Outside o;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (r.fitted[i]) o.last_fitted_s = r.time_s[i];
  }
  const LoadedRange range = loaded_range(r);
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (r.time_s[i] <= o.last_fitted_s || r.is_censored(i)) continue;
    ++o.count;
    if (!std::isfinite(r.predicted[i])) {
      if (o.unknown_s == 0.0) o.unknown_s = r.time_s[i];
      continue;
    }
    ++o.predicted;
    const double square = std::pow(r.predicted[i] - r.observed[i], 2);
    o.sum_of_squares += square;
    const double reached = (r.observed[i] - range.zero) * range.peak;
    if (reached < -kTurned * range.peak * range.peak) o.turned_squares += square;
    o.last_drive = r.drive[i];
  }
  return o;
}

/// True if samples are missing after the last fitted one, see end_before_unseen_motion.
bool ends_before_gap(const RecordingFit& r, double last_fitted_s) {
  constexpr double kGap = 20.0;  // times the interval before
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(r.time_s, last_fitted_s) -
                                             r.time_s.begin());
  if (next < 2 || next >= r.time_s.size()) return false;
  return r.time_s[next] - last_fitted_s >= kGap * (last_fitted_s - r.time_s[next - 2]);
}

/// The fitted part, the reason for its end, and how to fit another one.
std::string window_words(const std::string& name, const RecordingFit& r, const Outside& o) {
  const auto first = std::ranges::find(r.fitted, true);
  const auto begin = static_cast<std::size_t>(first - r.fitted.begin());
  return fmt::format(
      "{}: fitted from {} to {} s{}; to fit more, give the recording a later \"to\" in config.json "
      "and fit that file; --from-time and --until fit less",
      name, significant(r.time_s[begin], 4), significant(o.last_fitted_s, 4),
      ends_before_gap(r, o.last_fitted_s)
          ? ""
          : ": the fit ends where the drive first falls back, because contact may shrink from "
            "there on");
}

/// Depths of soft tissue are millimetres: metres come from a unit that is not the file's.
std::vector<Remark> unit_remarks(std::span<const PreparedRecording> recordings) {
  constexpr double kDeepest_m = 0.5;
  std::vector<Remark> remarks;
  for (const PreparedRecording& r : recordings) {
    if (r.recording.drive_quantity != Quantity::indentation_depth) continue;
    const auto [low, high] = std::ranges::minmax_element(r.recording.drive);
    if (*high - *low <= kDeepest_m) continue;
    remarks.push_back(
        {"unit_doubtful",
         fmt::format("{}: the depth changes by {} m: is its unit right? (--unit \"COLUMN=mm\")",
                     r.name, significant(*high - *low, 3))});
  }
  return remarks;
}

/// A hold under load that the window leaves out, and the ramps after the window.
struct LaterHold {
  double begin_s = 0.0, end_s = 0.0;
  double rest_s = 0.0;  ///< where the drive rests, or rises, before the ramp that leads to it
  int ramps = 0;
};

/// The longest hold after the window of a recording in whose window nothing is held.
std::optional<LaterHold> later_hold_of(const PreparedRecording& r) {
  constexpr double kLoaded = 0.1;  // of the travel from contact: less is a rest
  const std::vector<double>& time = r.recording.time_s;
  const std::vector<double>& drive = r.recording.drive;
  const double begin = r.phases.contact_found ? r.phases.contact_drive : drive.front();
  const auto held = [&](const Phase& phase) {
    const bool still = phase.kind == PhaseKind::hold || phase.kind == PhaseKind::creep;
    return still && drive[phase.last] - begin > kLoaded * (r.phases.peak_drive - begin);
  };
  std::optional<LaterHold> longest;
  double rest_s = r.to_s;
  int ramps = 0;
  bool unloaded = false, rising = false;
  for (const Phase& phase : r.phases.phases) {
    const double first_s = time[phase.first], last_s = time[phase.last];
    if (first_s < r.to_s) {
      if (held(phase)) return std::nullopt;
      continue;
    }
    ramps += phase.kind == PhaseKind::loading ? 1 : 0;
    unloaded = unloaded || phase.kind == PhaseKind::unloading || phase.kind == PhaseKind::detached;
    const bool loads = phase.kind == PhaseKind::loading || held(phase);
    if (!loads) rest_s = phase.kind == PhaseKind::unloading ? last_s : 0.5 * (first_s + last_s);
    rising = loads && (rising || phase.kind == PhaseKind::loading);
    const bool longer = !longest || last_s - first_s > longest->end_s - longest->begin_s;
    if (unloaded && held(phase) && rising && longer)
      longest = LaterHold{first_s, last_s, rest_s, 0};
  }
  if (longest) longest->ramps = ramps;
  return longest;
}

/// Why the hold is not fitted, and what fits it.
std::string later_hold_words(const PreparedRecording& r, const LaterHold& hold,
                             const FitConfig& config, const std::vector<double>& values) {
  std::string contact;
  const bool depth = r.recording.drive_quantity == Quantity::indentation_depth;
  if (config.law && depth && !r.load_imposed) {
    const Unit unit = shown_unit(Dimension::length);
    const double value = values[LawModel(*config.law).index("contact")];
    contact = fmt::format(" --contact \"{}\"", with_unit(significant(value / unit.to_si, 3), unit));
  }
  constexpr int kDigits = 6;
  return fmt::format(
      "{}: a hold of {} s ({} to {} s) and {} ramp{} after the first unloading (from {} s) are not "
      "fitted: relaxation is seen only through the first ramp; --from-time \"{} s\"{} fits the "
      "ramp that leads to this hold, with contact where the first ramp has it, and without the "
      "memory of what came before: right only if the rest before it lasted several times the "
      "longest relaxation time",
      r.name, significant(hold.end_s - hold.begin_s, 3), significant(hold.begin_s, kDigits),
      significant(hold.end_s, kDigits), hold.ramps, hold.ramps == 1 ? "" : "s",
      significant(r.to_s, kDigits), significant(hold.rest_s, 4), contact);
}

}  // namespace

std::string not_after_fit(const FitResult& fit) {
  double worst = kDescribesAfterFit;
  std::string words;
  for (const RecordingFit& r : fit.recordings) {
    const Outside o = outside_of(r);
    if (o.predicted < kFewestOutside || !(r.rms_residual > 0.0)) continue;
    if (ends_before_gap(r, o.last_fitted_s)) continue;
    const double rms = std::sqrt(o.sum_of_squares / static_cast<double>(o.predicted));
    if (!(rms > worst * r.rms_residual)) continue;
    worst = rms / r.rms_residual;
    words = fmt::format("; not the unloading and what follows{}: off by {} times that residual",
                        fit.recordings.size() == 1
                            ? ""
                            : fmt::format(" in '{}'", fit.config.data[r.choice].dataset),
                        significant(worst, 2));
  }
  return words;
}

std::vector<Remark> outside_remarks(const FitResult& fit) {
  constexpr double kMostly = 0.5;  // of the squares
  std::vector<Remark> remarks;
  for (const RecordingFit& r : fit.recordings) {
    const Outside o = outside_of(r);
    const std::string& name = fit.config.data[r.choice].dataset;
    if (o.predicted > 0 && o.predicted < kFewestOutside) {
      remarks.push_back(
          {"few_samples_after_fit",
           fmt::format("{}: {} sample{} after the fitted part (from {} s): too few to say "
                       "how the law describes what follows",
                       name, o.predicted, o.predicted == 1 ? "" : "s",
                       significant(o.last_fitted_s, 4))});
    } else if (o.predicted > 0) {
      const double rms = std::sqrt(o.sum_of_squares / static_cast<double>(o.predicted));
      const bool describes = rms <= kDescribesAfterFit * r.rms_residual;
      remarks.push_back(
          {describes ? "predicted_after_fit" : "not_described_after_fit",
           fmt::format(
               "{}: after the fitted part (from {} s, {} samples, to a drive of {}) the prediction "
               "is "
               "off by {} % of the peak (rms){}",
               name, significant(o.last_fitted_s, 4), o.predicted, significant(o.last_drive, 3),
               significant(100.0 * rms / r.peak, 3),
               describes ? ""
               : ends_before_gap(r, o.last_fitted_s)
                   ? ": it supposes that the drive moved evenly where no sample is recorded"
               : o.turned_squares > kMostly * o.sum_of_squares
                   ? ": there the load turns its sign (a specimen that is gripped, glued or "
                     "sticks), and these laws have none of that sign"
                   : ": the law does not describe the unloading and what follows")});
    }
    if (o.count >= kFewestOutside) {
      remarks.push_back({"fitted_part", window_words(name, r, o)});
    }
    if (o.predicted < o.count) {
      remarks.push_back(
          {"not_predicted_after_fit",
           fmt::format(
               "{}: from {} s on {} samples are not predicted: there the contact of a Hertz kernel "
               "shrinks or grows again in a way that the law does not cover (docs/laws.md)",
               name, significant(o.unknown_s, 4), o.count - o.predicted)});
    }
  }
  return remarks;
}

ProtocolSpans protocol_spans(std::span<const PreparedRecording> recordings) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ProtocolSpans spans{kInfinity, 0.0, kInfinity};
  for (const PreparedRecording& r : recordings) {
    const std::vector<double>& time = r.recording.time_s;
    for (const Phase& phase : r.phases.phases) {
      const double length = time[phase.last] - time[phase.first];
      if (time[phase.first] >= r.to_s) break;
      if (phase.kind == PhaseKind::loading) spans.ramp_s = std::min(spans.ramp_s, length);
      if (phase.kind == PhaseKind::hold) spans.hold_s = std::max(spans.hold_s, length);
      if (phase.last > phase.first) {
        spans.step_s =
            std::min(spans.step_s, length / static_cast<double>(phase.last - phase.first));
      }
    }
  }
  return spans;
}

void doubt_plateau(FitResult& fit, const ProtocolSpans& spans) {
  const auto long_for_hold = [&](const ParameterResult& p) {
    const bool time = !p.nuisance && p.parameter.unit.dimension == Dimension::time;
    return time && spans.too_short_to_end(p.estimate);
  };
  const bool seen = !(spans.hold_s > 0.0) || std::ranges::none_of(fit.parameters, long_for_hold);
  if (seen) return;
  for (ParameterResult& p : fit.parameters) {
    const bool closed = p.verdict == Verdict::identified || p.verdict == Verdict::lower_only;
    if (p.parameter.name != "k_inf" || !closed || p.not_separable) continue;
    p.not_separable = Remark{"plateau_or_slower_branch", "the plateau or a slower branch"};
    p.summary = parameter_words(p, fit.config.level);
  }
}

std::vector<Remark> recording_remarks(std::span<const PreparedRecording> recordings) {
  std::vector<Remark> remarks = unit_remarks(recordings);
  for (const PreparedRecording& r : recordings) {
    remarks.insert(remarks.end(), r.remarks.begin(), r.remarks.end());
  }
  return remarks;
}

std::vector<Remark> protocol_remarks(const FitResult& fit,
                                     std::span<const PreparedRecording> recordings) {
  std::vector<Remark> remarks;
  const auto [ramp_s, hold_s, step_s] = protocol_spans(recordings);
  bool later = false;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const auto hold = later_hold_of(recordings[i]);
    if (!hold) continue;
    later = true;
    remarks.push_back(
        {"hold_not_fitted", later_hold_words(recordings[i], *hold, fit.config,
                                             model_parameters(fit.config, fit.best.natural, i))});
  }
  if (hold_s == 0.0 && !later) {
    remarks.push_back({"no_hold", "there is no hold: relaxation is seen only through the ramp"});
  }
  for (const PreparedRecording& r : recordings) {
    if (!r.phases.preloaded || r.load_imposed) continue;
    const Unit unit = shown_unit(quantity_dimension(r.recording.response_quantity));
    remarks.push_back(
        {"rest_or_preload",
         fmt::format("{}: {} stands at rest and rises with the first movement: a preload, or the "
                     "zero of the force cell in the air; this recording does not tell which. Zero "
                     "and contact have wide priors; a rest before contact, or one withdrawn clear "
                     "of it, tells",
                     r.name,
                     with_unit(significant(r.phases.floor_response / unit.to_si, 3), unit))});
  }
  constexpr int kDigitsOfTime = 6;  // of a rounded one: "310 s", not "3.1e+02 s"
  for (const ParameterResult& p : fit.parameters) {
    // A delay of a rise is no time constant.
    const bool time = !p.nuisance && p.parameter.unit.dimension == Dimension::time;
    if (!time) continue;
    if (p.estimate < ramp_s) {
      remarks.push_back(
          {"shorter_than_ramp",
           fmt::format("{} = {} is shorter than the shortest ramp ({} s): what relaxed during the "
                       "ramp is known "
                       "only through the ramp's shape; a faster ramp would show it",
                       p.parameter.name, in_sized_unit(p, p.estimate), significant(ramp_s, 3))});
    }
    if (hold_s > 0.0 && p.estimate > hold_s / 3.0) {
      remarks.push_back(
          {"long_for_hold",
           fmt::format("{} = {} is long for the longest hold ({} s): no plateau is seen; hold for "
                       "at least {} s",
                       p.parameter.name, in_sized_unit(p, p.estimate), significant(hold_s, 3),
                       significant(rounded(3.0 * p.estimate, 2), kDigitsOfTime))});
    }
    if (p.estimate < kLeastSamples * step_s) {
      remarks.push_back({"undersampled", fmt::format("{} = {} is sampled by fewer than {} points "
                                                     "({} s apart): sampling cannot support it",
                                                     p.parameter.name, in_sized_unit(p, p.estimate),
                                                     kLeastSamples, significant(step_s, 3))});
    }
  }
  return remarks;
}

}  // namespace tpm::fit
