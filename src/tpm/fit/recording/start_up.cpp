#include "tpm/fit/recording/start_up.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tpm/base/median.hpp"
#include "tpm/base/text.hpp"

namespace tpm::fit {
namespace {

/// A ramp that has no sample between its ends, and the hold after it.
struct StepAndHold {
  Phase step, hold;
  bool first = false;  ///< nothing loads before it
};

std::vector<StepAndHold> steps_and_holds(const PreparedRecording& r) {
  constexpr std::size_t kAStep = 2;        // samples from end to end
  constexpr std::size_t kFewestHeld = 30;  // of which some can be spared
  std::vector<StepAndHold> found;
  bool loaded = false;
  for (std::size_t i = 0; i + 1 < r.phases.phases.size(); ++i) {
    const Phase& ramp = r.phases.phases[i];
    const Phase& hold = r.phases.phases[i + 1];
    if (ramp.kind != PhaseKind::loading) continue;
    const bool step = ramp.last - ramp.first <= kAStep;
    if (step && hold.kind == PhaseKind::hold && hold.last - hold.first >= kFewestHeld) {
      found.push_back({ramp, hold, !loaded});
    }
    loaded = true;
  }
  return found;
}

constexpr double kFarOut = 6.0;       // standard deviations of the noise
constexpr double kStartUpPart = 0.2;  // of a hold that may be left out

std::size_t end_of_start_up_part(const Phase& hold) {
  return hold.first +
         static_cast<std::size_t>(kStartUpPart * static_cast<double>(hold.last - hold.first));
}

/// The last sample in the first part of a hold that stands far out of its neighbours: a relaxation
/// is monotone, and what rings is not.
std::size_t end_of_ringing(const PreparedRecording& r, const Phase& hold) {
  const std::vector<double>& y = r.recording.response;
  const double far = kFarOut * r.phases.noise_sd_estimate;
  const std::size_t until = end_of_start_up_part(hold);
  std::size_t end = hold.first;
  for (std::size_t i = hold.first + 2; i + 2 < until && far > 0.0; ++i) {
    const double middle = median({y[i - 2], y[i - 1], y[i], y[i + 1], y[i + 2]});
    if (std::abs(y[i] - middle) > far) end = i + 1;
  }
  return end;
}

/// Where the response has risen to its largest in the first part of a hold: tissue relaxes while
/// the drive stands still, and what rises is a sensor that follows late. A drift rises to the end.
std::size_t end_of_rise(const PreparedRecording& r, const Phase& hold) {
  const double far = kFarOut * r.phases.noise_sd_estimate;
  const std::size_t until = end_of_start_up_part(hold);
  if (r.load_imposed || until <= hold.first) return hold.first;
  const std::vector<double>& y = r.recording.response;
  const double top = *std::max_element(y.begin() + static_cast<std::ptrdiff_t>(hold.first),
                                       y.begin() + static_cast<std::ptrdiff_t>(until));
  std::size_t end = hold.first;
  while (y[end] < top - far) ++end;
  const bool of_a_drift = end - hold.first > (until - hold.first) / 2;
  return top - y[hold.first] > 2.0 * far && !of_a_drift ? end : hold.first;
}

/// Begins the fit behind what follows the first step.
void begin_after(PreparedRecording& r, const Phase& hold) {
  constexpr double kTimesOfStep = 2.0;
  // The visible end is that of a tail above the noise, which takes about twice as long again to
  // vanish.
  constexpr std::size_t kTimesOfSeen = 3;
  const std::vector<double>& time = r.recording.time_s;
  const double step_s = time[hold.first] - time[hold.first - 1];
  const std::size_t ringing = end_of_ringing(r, hold);
  const std::size_t risen = end_of_rise(r, hold);
  const std::size_t seen = std::max(ringing, risen) - hold.first;
  const std::size_t vanished =
      std::min(hold.first + kTimesOfSeen * seen, std::max(end_of_start_up_part(hold), ringing));
  const double from_s = std::max(time[hold.first] + kTimesOfStep * step_s, time[vanished]);
  if (from_s <= r.from_s) return;
  const auto left_out =
      std::ranges::count_if(time, [&](double t) { return t >= time[hold.first] && t < from_s; });
  r.from_s = from_s;
  r.start_up = fmt::format(
      "{}: {} samples after the step are left out, to {} s: {} (--from-time leaves out more)",
      r.name, left_out, significant(from_s, 4),
      ringing > hold.first ? "they ring"
      : risen > hold.first ? "they rise, which no tissue does at rest"
                           : "the ramp within the step was not sampled");
}

/// Ends the fit before a later step after which readings ring, or rise: one stretch is fitted, and
/// what lies in its middle cannot be left out of it.
void end_before(PreparedRecording& r, const StepAndHold& later) {
  const std::vector<double>& time = r.recording.time_s;
  const bool rings = end_of_ringing(r, later.hold) > later.hold.first;
  if (!rings && end_of_rise(r, later.hold) == later.hold.first) return;
  const double step_s = time[later.step.first];
  if (step_s >= r.to_s || step_s <= r.from_s) return;
  r.to_s = step_s;
  r.start_up += fmt::format("{}{}: the fit ends before the step at {} s: the readings after it {}",
                            r.start_up.empty() ? "" : "; ", r.name, significant(step_s, 4),
                            rings ? "ring" : "rise, which no tissue does at rest");
}

}  // namespace

void leave_out_start_up(PreparedRecording& r) {
  for (const StepAndHold& step : steps_and_holds(r)) {
    if (step.first) {
      begin_after(r, step.hold);
    } else {
      end_before(r, step);
    }
  }
}

}  // namespace tpm::fit
