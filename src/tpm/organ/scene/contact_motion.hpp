#pragma once
// Motions and loads imposed on the contacts of a scene, on all or on one: the keys, and the
// protocol.
#include <filesystem>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/blocks/protocol_block.hpp"

namespace tpm::organ {

enum class MotionKind {
  ramp_hold,
  step_hold,
  creep,
  knots,
  sine,       ///< in and out, smoothly
  recording,  ///< the depths of a recording
};

/// Block `protocol` of a scene or of a contact as a file says it.
struct ContactMotionKeys {
  MotionKind kind = MotionKind::ramp_hold;
  ProtocolBlock block;  ///< of the first four
  double depth_m = 0.0, frequency_Hz = 0.0;
  int cycles = 1;
  std::string file;
};
[[nodiscard]] const Kinds<ContactMotionKeys, MotionKind>& contact_motion_kinds();

/// @param folder that the path of a recording is relative to
/// Throws Error(bad_input) at the key.
[[nodiscard]] Protocol protocol_of(const ContactMotionKeys& motion, const DocumentPlace& place,
                                   const std::filesystem::path& folder);

}  // namespace tpm::organ
