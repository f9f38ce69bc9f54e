#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

/// The two forms of a force in messages of the Inverse service: from 3.5 on under "vector", before
/// under "values".
enum class InverseFormat { vector, values };

[[nodiscard]] std::string_view to_string(InverseFormat format);

/// Format by the answer of GET /version, "3.5.0.0". Throws Error(environment) for a version
/// before 3.1 or from 4 on, or no version.
[[nodiscard]] InverseFormat format_of_version(std::string_view version);
/// The version in the answer to GET /version. Throws Error(bad_input).
[[nodiscard]] std::string parse_version(std::string_view text);

/// Most bytes of a message, devices and grips of an inventory.
inline constexpr std::size_t kMostInventoryBytes = 1'048'576, kMostMessageBytes = 65'536;
inline constexpr std::size_t kMostInverseDevices = 16;

/// The preset that puts the origin at the middle of the workspace.
inline constexpr std::string_view kCentredPreset = "arm_front_centered";

/// Identifier of the grip beside a simulated device.
inline constexpr std::string_view kSimulatedGrip = "SIMULATED_GRIP";

/// Settings that act on a force or a coordinate on its way between program and hand, as the service
/// says.
struct InverseSettings {
  std::string handedness;  ///< "left" or "right"
  std::string preset, basis = "XYZ";
  Eigen::Vector3d mount_position_m = Eigen::Vector3d::Zero(), mount_scale = Eigen::Vector3d::Ones();
  Eigen::Quaterniond mount_rotation = Eigen::Quaterniond::Identity();
  bool filters_named = false;    ///< false: the service says nothing of a force gate
  double force_gate_gain = 0.0;  ///< of the oscillation guard; 0: it changes no force
  bool damping_named = false;
  double damping = 0.0;
  Eigen::Vector3d directional_damping = Eigen::Vector3d::Zero();
  bool gravity_named = false, gravity_compensation = false;
  std::optional<bool> torque_scaling;  ///< empty: the service does not say
  double gravity_scaling = 0.0;

  /// A metre of the program is one of the device: a mount or workspace in another scale changes
  /// every stiffness.
  [[nodiscard]] bool true_to_scale() const;
  /// Share of the device's weight that the service carries.
  [[nodiscard]] double carried() const { return gravity_compensation ? gravity_scaling : 0.0; }
  /// One line for each thing that a recording names.
  [[nodiscard]] std::vector<Remark> lines() const;
};

struct InverseState {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero(), velocity_m_per_s = Eigen::Vector3d::Zero(),
                  force_N = Eigen::Vector3d::Zero();
  /// From the device's coordinates to those of the program.
  Eigen::Vector3d workspace_position_m = Eigen::Vector3d::Zero(),
                  workspace_scale = Eigen::Vector3d::Ones();
  Eigen::Quaterniond workspace_rotation = Eigen::Quaterniond::Identity();
  bool force_named = true;  ///< false: the message named no force
  bool driven = false;      ///< a program drives the device; written only
  // Of the first grip.
  bool has_grip = false;
  Eigen::Quaterniond grip = Eigen::Quaterniond::Identity();
  std::uint32_t buttons = 0;  ///< a, b, c
};

struct InverseDeviceEntry {
  std::string id, type, firmware;
  /// It says so itself: `simulated_device`, true or SIMULATED DEVICE, in its config, status or
  /// state, and nowhere otherwise.
  bool simulated = false;
  bool in_use = false;  ///< its status says so; which use that is is documented for tpm hil serve
  std::string control_mode;  ///< "idle": nobody commands it; empty: not named
  InverseSettings settings;
  InverseState state;
};

struct InverseInventory {
  std::int64_t session = 0;
  std::vector<InverseDeviceEntry> devices;
};

/// First message of a service. Sub-fields of a state that are missing equal the identity.
/// Throws Error(bad_input) with the key.
[[nodiscard]] InverseInventory parse_inventory(std::string_view text);
/// Later messages. Throws Error(bad_input) with the key, also if the device is not there.
[[nodiscard]] InverseState parse_state(std::string_view text, std::string_view device_id);

/// False if it is a message whose list of devices lacks this one.
[[nodiscard]] bool lists_device(std::string_view text, std::string_view device_id);

/// Request of a client to a device. Forces of several sources add up.
struct InverseCommand {
  std::optional<Eigen::Vector3d> force_N, position_m;
  std::string profile;  ///< of a program that registers itself; else empty
  std::string preset;   ///< of the coordinates; empty: not asked for
  std::string basis;    ///< the same of the axes
  std::optional<double> force_gate_gain, damping;
  Eigen::Vector3d directional_damping = Eigen::Vector3d::Zero();
  /// Settings and commands that are not read, by their names as far as they can be shown.
  std::vector<std::string> unread;
  /// Of the simulated grip: a, b, c. An addition of tpm hil serve to the protocol.
  std::optional<std::uint32_t> buttons;
  bool of_another_device = false;  ///< some of the message
};
/// A message of a client. Other devices and unknown keys are skipped. Throws Error(bad_input) with
/// the key: no object, a force that is no number.
[[nodiscard]] InverseCommand parse_command(std::string_view text, std::string_view device_id);

/// An event of the service.
struct InverseEvent {
  std::string name, level, device_id, safety_type, message;
};
/// An event needs no more than a name: what else it says is read as far as it is text, and
/// shortened. Throws Error(bad_input) without a name.
[[nodiscard]] InverseEvent parse_event(std::string_view text);

/// A force, N; with `profile` the program registers itself, once.
[[nodiscard]] std::string force_message(InverseFormat format, std::string_view device_id,
                                        const Eigen::Vector3d& force_N,
                                        std::string_view profile = {});
/// Makes neutral what a session may set: force gate and damping 0, the origin by kCentredPreset.
[[nodiscard]] std::string neutral_message(std::string_view device_id, std::string_view profile);
/// Asks for a state and commands nothing.
[[nodiscard]] std::string probe_message(std::string_view device_id);

/// A POST to the service.
struct InverseRequest {
  std::string target, body;
};
/// Requests that make neutral, over HTTP, the settings that are not: those of the session as
/// neutral_message() does, from 3.5 on; gravity compensation, which is the device's and has no
/// message, in each version.
/// @param carried share of the device's weight, 0 to 1
[[nodiscard]] std::vector<InverseRequest> neutral_requests(InverseFormat format,
                                                           std::string_view device_id,
                                                           std::int64_t session,
                                                           const InverseSettings& settings,
                                                           double carried);
/// @param simulated adds SIMULATED DEVICE to the device and its status
[[nodiscard]] std::string inventory_message(const InverseInventory& inventory);
[[nodiscard]] std::string state_message(std::int64_t session, std::string_view device_id,
                                        const InverseState& state, bool simulated);
[[nodiscard]] std::string version_message(std::string_view version, bool simulated);
[[nodiscard]] std::string event_message(const InverseEvent& event);

}  // namespace tpm::haptics
