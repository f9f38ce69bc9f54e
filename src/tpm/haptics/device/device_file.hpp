#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/device/device_limits.hpp"

namespace tpm::haptics {

/// Contents of the file of one device (schemas/device.schema.json): its kind, limits in place of
/// those of the list, and what was measured (`tpm hil identify` writes it).
struct DeviceFile {
  std::string where;   ///< the file, for messages
  std::string kind;    ///< as limits_of() takes it, or "plugin"
  std::string name;    ///< as its maker writes it; may be empty
  std::string serial;  ///< of the device that was measured; empty: it says none
  std::optional<double> force_N, reach_m, stiffness_N_per_m, damping_N_s_per_m, slew_N_per_s,
      least_ramp_in_s, encoder_step_m, friction_N_s_per_m;
  /// Where a limit comes from, by its key.
  std::vector<std::pair<std::string, std::string>> provenance;
  /// Largest delay from a position to its force, both paths together and without the hold of a
  /// command, s. Empty unless it was measured: an assumed one is not counted.
  std::optional<double> measured_delay_s;
  /// Lower bound of the viscous friction at 95 %, N s/m. Empty unless it was measured.
  std::optional<double> measured_friction_N_s_per_m;
  double measured_period_s = 0.0;  ///< of the loop that measured the delay; 0: not known
  bool measured = false;           ///< something in it was measured: it is of one device
  bool simulated = false;          ///< measured on a simulated device: says nothing of hardware
};

/// Throws Error(bad_input) with file and key.
[[nodiscard]] DeviceFile read_device_file(const std::filesystem::path& file);
[[nodiscard]] DeviceFile parse_device_file(const Json& json, const std::string& where);

/// Kinds of the device files that are installed with the program (configs/devices), sorted.
[[nodiscard]] std::vector<std::string> shipped_devices();
/// The file of one of them; none of another kind. Throws Error(bad_input).
[[nodiscard]] std::optional<DeviceFile> shipped_device_file(std::string_view kind);
/// Limits of a device that is known by its file alone. Throws Error(bad_input) if one is missing.
[[nodiscard]] DeviceLimits limits_in(const DeviceFile& file);

/// Limits of the device that a file describes: those of its kind as far as the file says no others,
/// of a kind that the program does not know, or a plugin, the file's own.
/// @param kind that the device is said to be; empty: that of the file
/// Throws Error(bad_input) as limits_in() and limits_by_file(), Error(usage) for an unknown kind
/// that is not the file's.
[[nodiscard]] DeviceLimits limits_from(const DeviceFile& file, std::string_view kind = {});

/// limits_from() for a device that may have motors: a file of the simulated device, or of a replay,
/// counts only where the kind says so. Throws Error(bad_input) as limits_from(), and otherwise.
[[nodiscard]] DeviceLimits limits_of_motors(const DeviceFile& file, std::string_view kind = {});

/// Limits of a kind of device as far as a file says others. Throws Error(bad_input) if the file is
/// of another kind, or a limit is above that of the kind.
[[nodiscard]] DeviceLimits limits_by_file(DeviceLimits limits, const DeviceFile& file);

}  // namespace tpm::haptics
