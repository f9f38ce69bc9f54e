#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tpm::haptics {

/// Most viscous friction that a device may claim: no handle that a hand moves has more, and the
/// gate trusts it.
inline constexpr double kMostHandleFriction_N_s_per_m = 10.0;

/// Stop of the Omega.7 along x, from the centre: half of the 110 mm of its data sheet,
/// which was not looked up; assumed.
inline constexpr double kOmega7StopAlongX_m = 0.055;

/// Limits of a kind of device. Numbers that nobody has measured here are marked.
struct DeviceLimits {
  std::string kind;
  std::string name;                ///< as its maker writes it
  bool tried = false;              ///< against the maker's library; none has been tried on hardware
  double force_N = 0.0;            ///< data sheet
  double reach_m = 0.0;            ///< radius of the workspace, as commonly used
  double stiffness_N_per_m = 0.0;  ///< recommended maximum, CHAI3D 3.3's software limit
  double damping_N_s_per_m = 0.0;  ///< CHAI3D 3.3's software limit
  double slew_N_per_s = 0.0;       ///< assumed: full force within 6 ms
  double least_ramp_in_s = 0.0;    ///< assumed: longer than a hand takes to stiffen
  double friction_N_s_per_m = 0.0;  ///< assumed: the least of what is usual, 0.1 to 1
  int delay_periods = 0;            ///< assumed, from a command to its force
  double encoder_step_m = 1e-5;     ///< assumed: the data sheet of the Omega.7 says less
  bool plant = false;               ///< it is VirtualOmega7 with these limits, not a device
  bool simulated = false;           ///< of a plugin: it says that it has no motors
  /// Largest delay of both paths and least viscous friction that were measured on this device
  /// (device_file.hpp). Hardware without them has the longest delay and no friction
  /// (haptics/session/rendering_check.hpp), whatever is assumed above.
  std::optional<double> measured_delay_s = std::nullopt;
  std::optional<double> measured_friction_N_s_per_m = std::nullopt;
  /// Where each limit comes from, by its key in a device file; of devices known by a shipped file.
  std::vector<std::pair<std::string, std::string>> provenance = {};
  double measured_period_s = 0.0;  ///< of the loop that measured the delay; 0: not known
  double stop_along_x_m = 0.0;     ///< of the mechanism, from the centre; 0: none within reach_m

  /// Provenance of the limit with this key; "assumed" where nothing is said.
  [[nodiscard]] std::string_view known_by(std::string_view key) const;
  /// Its motors may move: it is neither simulated nor a replay.
  [[nodiscard]] bool hardware() const { return kind != "replay" && !plant && !simulated; }
};

/// Of the kind that a session is run on, "omega7" or what simulates or replays one; the simulated
/// device has the limits of the real one. Other kinds have a shipped file (device_file.hpp).
/// Throws Error(usage) for one that has none.
[[nodiscard]] DeviceLimits limits_of(std::string_view kind);

/// All kinds, as --device takes them: those that this library knows by itself and those with a
/// shipped file. Plugins bring their own limits (plugin_device.hpp).
[[nodiscard]] std::vector<std::string> device_kinds();

}  // namespace tpm::haptics
