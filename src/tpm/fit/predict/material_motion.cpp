// Declared in tpm/fit/predict/organ_material.hpp.
// The motions that a law and an organ are compared along.
#include <fmt/format.h>

#include <algorithm>

#include "tpm/data/straight_pieces.hpp"
#include "tpm/fit/predict/organ_material.hpp"
#include "tpm/fit/predict/organ_readings.hpp"
#include "tpm/fit/predict/prediction_parts.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kMostTimes = 200;  // of a motion, that the forces are compared at

/// Contact and offset of the fit if the law was fitted to this recording; else those that suit it
/// best. What is held is kept.
RecordingPlacement placement_of(const LawFile& law, const PreparedRecording& recording,
                                const PredictionOptions& held) {
  const bool holds = held.contact || held.zero;
  const auto fitted = holds ? std::nullopt : values_in_fit(law, recording);
  const std::vector<double> values =
      fitted ? *fitted : place_recording(law, recording, held).values;
  return {values[values.size() - 2], values.back()};
}

}  // namespace

MaterialMotion motion_of_recording(const LawFile& law, const PreparedRecording& recording,
                                   const PredictionOptions& held) {
  const Recording& r = recording.recording;
  require_quantities_of(law, recording);
  const RecordingPlacement placement = placement_of(law, recording, held);
  std::vector<double> time_s, drive_m, force_N;
  for (std::size_t i = 0; i < r.time_s.size() && r.time_s[i] <= recording.to_s; ++i) {
    if (r.time_s[i] < recording.from_s) continue;
    time_s.push_back(r.time_s[i]);
    drive_m.push_back(r.drive[i]);
    force_N.push_back(r.response[i] - placement.offset_N);
  }
  if (!(*std::max_element(drive_m.begin(), drive_m.end()) > placement.contact_m)) {
    throw bad_input(fmt::format("recording '{}'", recording.name), "does not press the tissue",
                    "a depth beyond the law's contact");
  }
  Protocol whole = measured_history(Drive::displacement, time_s, drive_m);
  whole.set_equilibrium_at_start(true);
  const Protocol drive = followed_by_organ(whole, placement.contact_m);
  MaterialMotion motion{recording.name, beyond_contact(drive, placement.contact_m), {}};
  const std::size_t stride = 1 + time_s.size() / kMostTimes;
  for (std::size_t i = 0; i < time_s.size(); i += stride) {
    motion.time_s.push_back(time_s[i]);
    motion.measured_N.push_back(force_N[i]);
  }
  motion.drive = drive;
  motion.placement = placement;
  motion.provenance = r.provenance;
  return motion;
}

MaterialMotion motion_of_protocol(const Protocol& protocol, std::vector<double> times_s) {
  if (protocol.drive() != Drive::displacement || !(protocol.peak() > 0.0)) {
    throw bad_input("protocol", "does not press the tissue to a depth", "imposed depths above 0");
  }
  std::vector<double> times;
  const std::size_t stride = 1 + times_s.size() / kMostTimes;
  for (std::size_t i = 0; i < times_s.size(); i += stride) times.push_back(times_s[i]);
  return {{}, protocol, std::move(times)};
}

}  // namespace tpm::fit
