#include "tpm/fit/select/channel_cause.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "tpm/base/sized_unit.hpp"
#include "tpm/fit/adequacy.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/select/fit_adequacy.hpp"
#include "tpm/work/give_up.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

/// The values a time later, by straight lines between samples.
std::vector<double> delayed(std::span<const double> time_s, std::span<const double> values,
                            double delay_s) {
  std::vector<double> late;
  late.reserve(values.size());
  std::size_t k = 0;
  for (const double t : time_s) {
    const double when = t - delay_s;
    while (k + 1 < time_s.size() && time_s[k + 1] <= when) ++k;
    if (when <= time_s.front() || k + 1 >= time_s.size()) {
      late.push_back(values[k]);
      continue;
    }
    const double share = (when - time_s[k]) / (time_s[k + 1] - time_s[k]);
    late.push_back(values[k] + share * (values[k + 1] - values[k]));
  }
  return late;
}

/// Low pass of first order; between samples the values are straight lines.
std::vector<double> low_passed(std::span<const double> time_s, std::span<const double> values,
                               double tau_s) {
  std::vector<double> out(values.begin(), values.end());
  for (std::size_t i = 1; i < out.size(); ++i) {
    const double step = time_s[i] - time_s[i - 1];
    const double behind = tau_s * (values[i] - values[i - 1]) / step;
    out[i] = values[i] - behind + (out[i - 1] - values[i - 1] + behind) * std::exp(-step / tau_s);
  }
  return out;
}

/// Fit of a law to the recording with a fault corrected.
struct FaultTrial {
  ChannelFault fault = ChannelFault::response_delayed;
  double time_s = 0.0;
  double residual_over_noise = std::numeric_limits<double>::infinity();
  bool adequate = false;
};

/// Standard deviation of the first readings about a straight line; none below 8 of them.
std::optional<double> noise_of_first(std::span<const double> time_s, std::span<const double> values,
                                     std::size_t count) {
  constexpr std::size_t kFewestAtRest = 8;
  if (count < kFewestAtRest) return std::nullopt;
  const auto n = static_cast<double>(count);
  double t = 0.0, y = 0.0, tt = 0.0, ty = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double time = time_s[i] - time_s[0], value = values[i] - values[0];
    t += time / n;
    y += value / n;
    tt += time * time / n;
    ty += time * value / n;
    yy += value * value / n;
  }
  const double slope = (ty - t * y) / (tt - t * t);
  return std::sqrt(std::max(yy - y * y - slope * (ty - t * y), 0.0) * n / (n - 2.0));
}

FaultTrial trial_of(const LawSpec& law, const PreparedRecording& r, ChannelFault fault,
                    double time_s, const SetupOptions& setup) {
  constexpr double kWhole = 0.98;  // of the travel
  constexpr double kAlike = 1.5;   // in spread
  FaultTrial trial{fault, time_s};
  const auto travel = [](const PreparedRecording& one) {
    return one.phases.peak_drive - one.phases.contact_drive;
  };
  const auto work = [&] {
    const std::array one{prepare_recording(r.name, with_same_fault(r.recording, fault, time_s))};
    const PreparedRecording& mended = one.front();
    // The law does not describe samples that a shift leaves out of the fit, and a load that begins
    // before the motion is no noise.
    if (mended.load_imposed || travel(mended) < kWhole * travel(r)) return;
    const Recording& read = mended.recording;
    const std::size_t at_rest = samples_at_rest(mended.phases);
    const auto noise = noise_of_first(read.time_s, read.response, at_rest);
    const auto before =
        noise_of_first(read.time_s, read.response, std::min(at_rest, samples_at_rest(r.phases)));
    if (!noise || !before || *noise > kAlike * *before) return;
    FitResult fit = run_fit(recording_config(law, one, setup), data_sets(one));
    state_adequacy(fit, one);
    if (!fit.adequacy || !fit.adequacy->residual_over_noise) return;
    trial.residual_over_noise =
        std::max(*fit.adequacy->residual_over_noise, fit.recordings.front().rms_residual / *noise);
    trial.adequate = fit.adequacy->is_adequate();
  };
  try {
    static_cast<void>(gave_up(work));
  } catch (const Error& error) {
    if (error.code() != ExitCode::bad_input) throw;  // no recording any more
  }
  return trial;
}

/// The time of one fault that leaves least, between two: golden sections of its logarithm.
FaultTrial refined(const LawSpec& law, const PreparedRecording& r, const FaultTrial& coarse,
                   double factor, const SetupOptions& setup) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSections = 14;
  FaultTrial best{coarse.fault, coarse.time_s};
  double low = std::log(coarse.time_s / factor), high = std::log(coarse.time_s * factor);
  const auto at = [&](double log_time) {
    FaultTrial trial = trial_of(law, r, coarse.fault, std::exp(log_time), setup);
    if (trial.residual_over_noise < best.residual_over_noise) best = trial;
    return trial;
  };
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  FaultTrial at_a = at(a), at_b = at(b);
  for (int i = 0; i < kSections; ++i) {
    if (at_a.residual_over_noise < at_b.residual_over_noise) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = at(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = at(b);
    }
  }
  return best;
}

std::string fault_words(const FaultTrial& trial, const Recording& r) {
  const std::string_view load = load_word(r), answer = answer_word(r);
  const std::string time = sized_text(Dimension::time, trial.time_s, 2);
  switch (trial.fault) {
    case ChannelFault::response_delayed:
      return fmt::format("the {} is recorded {} later than the {}", load, time, answer);
    case ChannelFault::drive_delayed:
      return fmt::format("the {} is recorded {} later than the {}", answer, time, load);
    case ChannelFault::response_filtered:
      return fmt::format("the {} follows late, as behind a filter with a time constant of {}", load,
                         time);
    case ChannelFault::drive_filtered:
      return fmt::format("the {} follows late, as behind a filter with a time constant of {}",
                         answer, time);
  }
  return {};
}

/// Laws that were fitted, from the least to the most general: a law with fewer parameters tells the
/// time better.
std::vector<LawSpec> laws_to_try(const Selection& s) {
  constexpr std::array kKernels{Kernel::linear, Kernel::hertz, Kernel::power};
  std::vector<LawSpec> laws;
  for (const int branches : {1, 2}) {
    for (const Kernel kernel : kKernels) {
      for (const Candidate& c : s.candidates) {
        const bool plain =
            c.law.tension == Tension::none && c.law.fractional == Fractional::none && c.law.solid;
        if (c.failed || !plain || c.law.branches != branches || c.law.kernel != kernel) continue;
        laws.push_back(c.law);
      }
    }
  }
  return laws;
}

/// The law that the first look is taken with: one branch, and the most general kernel.
const LawSpec& general_law(const std::vector<LawSpec>& laws) {
  const LawSpec* general = &laws.front();
  for (const LawSpec& law : laws) {
    if (law.branches == laws.front().branches) general = &law;
  }
  return *general;
}

/// Time from the begin of the load to the largest drive.
double rise_s(const PreparedRecording& r) {
  const std::vector<double>& drive = r.recording.drive;
  const auto peak = static_cast<std::size_t>(std::ranges::max_element(drive) - drive.begin());
  const std::size_t begin = r.phases.contact_found ? r.phases.contact_index : 0;
  return peak > begin ? r.recording.time_s[peak] - r.recording.time_s[begin] : 0.0;
}

/// True if the preferred law gains by a branch that is a dashpot: a filter looks the same.
bool prefers_a_dashpot(const Selection& s) {
  if (!s.preferred) return false;
  return std::ranges::any_of(
      s.candidates[*s.preferred].fit.parameters, [](const ParameterResult& p) {
        return !p.nuisance && p.at_lower_bound && p.parameter.unit.dimension == Dimension::time;
      });
}

/// True if the probe comes through the air and the load falls below its rest as it withdraws: it
/// sticks to the specimen, which bends the loading near contact, too.
bool sticks(const PreparedRecording& r) {
  constexpr double kAir = 0.01, kPulls = 0.01;  // of the travel, and of the load
  constexpr double kSure = 8.0;                 // standard deviations of the noise
  constexpr int kInARow = 3;
  const RecordingPhases& found = r.phases;
  const Recording& read = r.recording;
  const double travel = found.peak_drive - found.contact_drive;
  if (read.drive_quantity != Quantity::indentation_depth || !found.contact_found ||
      found.preloaded || found.contact_drive - read.drive.front() < kAir * travel) {
    return false;
  }
  const double least =
      found.floor_response - std::max(kSure * found.noise_sd_estimate,
                                      kPulls * (found.peak_response - found.floor_response));
  const auto peak = std::ranges::max_element(read.drive) - read.drive.begin();
  int count = 0;
  for (std::size_t i = static_cast<std::size_t>(peak); i < read.response.size(); ++i) {
    count = read.response[i] < least ? count + 1 : 0;
    if (count == kInARow) return true;
  }
  return false;
}

/// True if a law that was fitted describes the recording, by its rests.
bool one_describes(const Selection& s, std::span<const PreparedRecording> recordings) {
  return std::ranges::any_of(s.candidates, [&](const Candidate& c) {
    if (c.failed) return false;
    FitResult fit = c.fit;
    fit.adequacy.reset();
    state_adequacy(fit, recordings);
    return fit.adequacy && fit.adequacy->is_adequate();
  });
}

}  // namespace

Recording with_same_fault(Recording r, ChannelFault fault, double time_s) {
  const bool of_response =
      fault == ChannelFault::response_delayed || fault == ChannelFault::response_filtered;
  const bool delay =
      fault == ChannelFault::response_delayed || fault == ChannelFault::drive_delayed;
  std::vector<double>& other = of_response ? r.drive : r.response;
  other = delay ? delayed(r.time_s, other, time_s) : low_passed(r.time_s, other, time_s);
  return r;
}

void name_channel_cause(Selection& s, std::span<const PreparedRecording> recordings,
                        const SetupOptions& setup) {
  constexpr std::size_t kMost = 5000;  // samples
  constexpr std::array kSteps{1.0, 1.5,  2.0,  3.0,  4.0, 6.0,
                              8.0, 12.0, 16.0, 24.0, 32.0};       // samplings
  constexpr double kOfRamp = 0.5, kFewSteps = 16.0, kLeft = 1.5;  // noises
  constexpr double kFactor = 2.0, kLongest = 0.1;                 // of the recording
  FitResult& fit = s.candidates[s.recommended].fit;
  if (recordings.size() != 1 || !fit.adequacy || !fit.adequacy->is_rejected()) return;
  const PreparedRecording& r = recordings.front();
  const bool of_unloading = s.candidates[s.recommended].unloading_refutes;
  const bool judged = fit.adequacy->residual_over_noise.has_value();
  if (!judged || (!of_unloading && !fit.adequacy->causes.empty()) || r.load_imposed ||
      r.contact_held || r.clipped_above || r.clipped_below || r.recording.time_s.size() > kMost) {
    return;
  }
  if (!of_unloading && one_describes(s, recordings) && !prefers_a_dashpot(s)) return;
  if (sticks(r)) {
    const std::string cause = fmt::format(
        "adhesion: the {} falls below its rest as the probe withdraws: it sticks, which these laws "
        "do not have",
        load_word(r.recording));
    fit.adequacy->causes.push_back({"adhesion", cause});
    fit.adequacy->summary += fmt::format("; likely cause: {}", cause);
    return;
  }
  if (of_unloading) return;  // a channel that is late bends the loading, too
  SetupOptions quick = setup;
  quick.profiles = false;
  quick.placements = nullptr;
  quick.starts = 4;
  const std::vector<LawSpec> laws = laws_to_try(s);
  if (laws.empty()) return;
  const double step_s = median_step(r.recording.time_s);
  // A delay as slow as the ramp would leave only the hold to be compared, and looks like tissue.
  const double longest_s =
      std::min(std::max(kOfRamp * rise_s(r), kFewSteps * step_s), kLongest * (r.to_s - r.from_s));
  const auto likelier = [&](ChannelFault one, ChannelFault other) {
    FaultTrial best{one, 0.0};
    for (const ChannelFault fault : {one, other}) {
      for (const double steps : kSteps) {
        if (steps * step_s > longest_s) break;
        const FaultTrial trial = trial_of(general_law(laws), r, fault, steps * step_s, quick);
        if (trial.residual_over_noise < best.residual_over_noise) best = trial;
      }
    }
    return best;
  };
  const std::array trials{likelier(ChannelFault::response_delayed, ChannelFault::drive_delayed),
                          likelier(ChannelFault::response_filtered, ChannelFault::drive_filtered)};
  for (const LawSpec& law : laws) {
    std::vector<std::string> found;
    double least = std::numeric_limits<double>::infinity();
    for (const FaultTrial& trial : trials) {
      if (!(trial.time_s > 0.0)) continue;
      const FaultTrial best = refined(law, r, trial, kFactor, quick);
      // An adequacy that few independent samples could not refuse supports nothing.
      if (!best.adequate || best.residual_over_noise > kLeft) continue;
      found.push_back(fault_words(best, r.recording));
      least = std::min(least, best.residual_over_noise);
    }
    if (found.empty()) continue;
    const std::string cause =
        fmt::format("{} (with that, {} leaves {} times the noise)", fmt::join(found, ", or "),
                    law_name(law), times_text(least));
    fit.adequacy->causes.push_back({"late_channel", cause});
    fit.adequacy->summary += fmt::format("; likely cause: {}", cause);
    return;
  }
}

}  // namespace tpm::fit
