#pragma once
// A session as its file says it: the declaration of all its keys.
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/blocks/protocol_block.hpp"
#include "tpm/files/keys/file_kind.hpp"
#include "tpm/haptics/session/session.hpp"

namespace tpm::haptics {

/// Rates of a servo loop.
inline constexpr double kLeastRate_Hz = 500.0, kMostRate_Hz = 4000.0;

/// Block `model`.
struct SessionModelKeys {
  std::string kind = std::string(kPlannedModel);
  std::optional<double> tool_radius_m, contact_stiffness_N_per_m;  ///< of the kind surface
  Json contact;                                                    ///< null: none
  std::optional<std::string> tolerance;                            ///< of the kind planned
  Json law, scene;  ///< a name of a file, or what it would hold; null: none
};

/// Block `limits`. The servo's other settings are as usual.
struct LimitKeys {
  SessionServo servo;
  double watchdog_s = DevicePreparation{}.watchdog_s;
  double cycle_timeout_s = HilSession{}.cycle_timeout_s;
};

/// Blocks `indentations` and `creep`.
struct TouchKeys {
  ProtocolLists protocol;
  double rest_s = 5.0;
};

/// Block `slides`.
struct SlideKeys {
  std::vector<double> depths_m;
  double press_m_per_s = 4e-3;
  std::array<double, 3> direction{1.0, 0.0, 0.0};
  double distance_m = 0.0, rate_m_per_s = 0.0, rest_s = 5.0;
};

/// Block `motion`: the name of a recording, or the motion itself.
struct MotionKeys {
  std::optional<std::string> recording, name;
  double initial_hold_s = 0.0;
  std::optional<double> spacing_s;
  std::vector<double> depths_m, measured_N;
};
[[nodiscard]] const Block<MotionKeys>& motion_block();

/// Block `virtual_device`.
struct VirtualDeviceKeys {
  PlantSettings plant;
  std::optional<double> damping_N_s_per_m;  ///< as in `plant`, if it is stated
};

struct SessionKeys {
  std::string title = "session", description;
  SessionModelKeys model;
  double rate_Hz = 1000.0;
  std::optional<std::array<double, 3>> push;
  std::optional<std::array<double, 3>> surface_m;
  std::optional<double> surface_before_hand_m;
  StartGateSettings start;
  DeviceMounting mounting;
  LimitKeys limits;
  std::optional<TouchKeys> indentations, creep;
  std::optional<SlideKeys> slides;
  std::optional<MotionKeys> motion;
  VirtualDeviceKeys virtual_device;
};
[[nodiscard]] const Block<SessionKeys>& session_block();
[[nodiscard]] const FileKind& session_kind();

}  // namespace tpm::haptics
