#include "tpm/organ/scene/contact_motion.hpp"

#include <cmath>
#include <numbers>

#include "tpm/files/import/recording_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

constexpr int kPiecesOfCycle = 64;

ProtocolKind plain_kind(MotionKind kind) {
  switch (kind) {
    case MotionKind::step_hold:
      return ProtocolKind::step_hold;
    case MotionKind::creep:
      return ProtocolKind::creep;
    case MotionKind::knots:
      return ProtocolKind::knots;
    case MotionKind::ramp_hold:
    case MotionKind::sine:
    case MotionKind::recording:
      break;
  }
  return ProtocolKind::ramp_hold;
}

Kind<ContactMotionKeys, MotionKind> plain_motion(MotionKind kind, const char* sentence) {
  std::vector<Key<ContactMotionKeys>> keys;
  for (const Key<ProtocolBlock>& key : protocol_kinds().keys(plain_kind(kind))) {
    keys.push_back(within(&ContactMotionKeys::block, key));
  }
  return {kind, std::string(entry_of(kProtocolKindWords, plain_kind(kind)).text), sentence,
          std::move(keys)};
}

/// From rest to a depth and back, u = (1 - cos 2 pi f t) d/2, through points at even times.
Protocol sine_of(const ContactMotionKeys& motion) {
  std::vector<Knot> knots;
  for (int i = 0; i <= kPiecesOfCycle * motion.cycles; ++i) {
    const double cycles = static_cast<double>(i) / kPiecesOfCycle;
    const double depth = 0.5 * motion.depth_m * (1.0 - std::cos(2.0 * std::numbers::pi * cycles));
    knots.push_back({cycles / motion.frequency_Hz, i % kPiecesOfCycle == 0 ? 0.0 : depth});
  }
  return {Drive::displacement, std::move(knots), "sine"};
}

Protocol motion_of_recording(const ContactMotionKeys& motion, const DocumentPlace& place,
                             const std::filesystem::path& folder) {
  const DocumentPlace at = place.key("file");
  const auto recording = [&] {
    try {
      return read_recording_file(folder / motion.file).recording;
    } catch (const Error& error) {
      throw error.within(at.where);
    }
  }();
  const std::vector<double>& depth_m = recording.depth_m();
  if (recording.time_s.size() != depth_m.size() || depth_m.size() < 2) {
    throw bad_input(at.where, "has no motion over time", "a recording of times and depths");
  }
  std::vector<Knot> knots;
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    knots.push_back({recording.time_s[i] - recording.time_s.front(), depth_m[i] - depth_m.front()});
  }
  return {Drive::displacement, std::move(knots), at.where};
}

}  // namespace

const Kinds<ContactMotionKeys, MotionKind>& contact_motion_kinds() {
  using K = ContactMotionKeys;
  static const Kinds<K, MotionKind> kinds(
      {.name = "contact_protocol", .sentence = "what is imposed on a contact, from rest on"},
      &K::kind,
      {plain_motion(MotionKind::ramp_hold, "a ramp to a depth, which is then held"),
       plain_motion(MotionKind::step_hold, "a jump to a depth, which is then held"),
       plain_motion(MotionKind::creep, "a load, applied as a step and kept"),
       plain_motion(MotionKind::knots, "a history that is linear between corners"),
       {MotionKind::sine,
        "sine",
        "in and out smoothly, (1 - cos 2 pi f t) / 2 of the depth, through 64 points a cycle",
        {required(
             key("depth", &K::depth_m, quantity(Dimension::length, kAboveZero), "largest depth")),
         required(key("frequency", &K::frequency_Hz, quantity(Dimension::frequency, kAboveZero),
                      "cycles a second")),
         key("cycles", &K::cycles, whole<int>(1, 1000), "how often")}},
       {MotionKind::recording,
        "recording",
        "the depths of a recording, counted from its first reading",
        {required(key("file", &K::file, text(1),
                      "a recording that tpm reads without options, relative to the scene"))}}});
  return kinds;
}

Protocol protocol_of(const ContactMotionKeys& motion, const DocumentPlace& place,
                     const std::filesystem::path& folder) {
  if (motion.kind == MotionKind::sine) return sine_of(motion);
  if (motion.kind == MotionKind::recording) return motion_of_recording(motion, place, folder);
  ProtocolBlock block = motion.block;
  block.kind = plain_kind(motion.kind);
  return block.protocol(place);
}

}  // namespace tpm::organ
