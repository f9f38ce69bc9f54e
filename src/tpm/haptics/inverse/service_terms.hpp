#pragma once
#include <algorithm>
#include <cctype>
#include <string_view>

#include "tpm/haptics/inverse/messages.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

/// Longest time that a service has for an answer before a session and in virtual time, s.
inline constexpr double kPatience_s = 2.0;

/// A service with which no session can begin.
inline Error service_fault(std::string_view what, std::string_view expected) {
  return {ExitCode::environment, "inverse3", what, expected};
}

/// Identifiers are told in capitals or small letters.
inline bool same_id(std::string_view a, std::string_view b) {
  return std::ranges::equal(
      a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// Rotations and scales within these are none.
inline constexpr double kTurned_rad = 1e-6, kScaled = 1e-9;

inline double angle_rad(const Eigen::Quaterniond& rotation) {
  return rotation.angularDistance(Eigen::Quaterniond::Identity());
}

/// A metre of the program is one of the device.
inline bool is_scaled_as_device(const InverseState& state) {
  return state.workspace_scale.isApprox(Eigen::Vector3d::Ones(), kScaled);
}

/// A direction of the program is that of the device.
inline bool is_turned_as_device(const InverseState& state) {
  return angle_rad(state.workspace_rotation) < kTurned_rad;
}

}  // namespace tpm::haptics
