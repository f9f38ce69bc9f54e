#include "tpm/fit/recording/end_of_test.hpp"

#include <algorithm>
#include <vector>

namespace tpm::fit {
namespace {

/// True for creep and recovery of a specimen whose stress is imposed: it has no contact that could
/// shrink when the stress falls, and what it recovers tells flow from a slow branch.
bool recovers(const PreparedRecording& r) {
  return r.load_imposed && r.recording.response_quantity == Quantity::strain;
}

bool is_after_the_test(PhaseKind kind) {
  return kind == PhaseKind::unloading || kind == PhaseKind::detached || kind == PhaseKind::recovery;
}

/// A drive that overshoots falls back a little to where it is then held: that is no unloading.
bool swings_back(const PreparedRecording& r, const Phase& phase) {
  constexpr double kLittle = 0.1;  // of the travel
  if (phase.kind != PhaseKind::unloading) return false;
  const std::vector<double>& drive = r.recording.drive;
  const double begin = r.phases.contact_found ? r.phases.contact_drive : drive.front();
  const auto end = drive.begin() + static_cast<std::ptrdiff_t>(phase.last) + 1;
  const double peak = *std::max_element(drive.begin(), end);
  const bool held_later = std::ranges::any_of(r.phases.phases, [&](const Phase& later) {
    return later.kind == PhaseKind::hold && later.first >= phase.last &&
           peak - drive[later.first] <= kLittle * (peak - begin);
  });
  return held_later && peak - drive[phase.last] <= kLittle * (peak - begin);
}

}  // namespace

double end_of_test(const PreparedRecording& r) {
  const std::vector<double>& time = r.recording.time_s;
  bool pressed = false;
  for (const Phase& phase : r.phases.phases) {
    pressed = pressed || phase.kind == PhaseKind::loading || phase.kind == PhaseKind::hold;
    if (!pressed || !is_after_the_test(phase.kind) || swings_back(r, phase)) continue;
    return recovers(r) ? time.back() : time[phase.first];
  }
  return time.back();
}

}  // namespace tpm::fit
