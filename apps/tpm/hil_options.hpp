#pragma once
#include "command.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/session/session_run.hpp"

namespace tpm::app {

/// Options that every command with a device has.
struct DeviceOptions {
  DeviceChoice choice;
  std::string library, replay, plugin, file;
  std::string serial;  ///< empty: not given
  int index = -1;      ///< -1: not given
  std::string real_time = "ignore";
};

/// Adds --device, --serial, --index, --dhd-library, --device-recording, --may-move and
/// --take-as-ready.
void add_device_options(CLI::App& command, DeviceOptions& options);

/// --dhd-library alone.
void add_dhd_library(CLI::App& command, DeviceOptions& options);
/// --inverse-port, --inverse-events-port and --inverse-http-port alone. @param of ends the words of
/// the first
void add_inverse_ports(CLI::App& command, DeviceOptions& options, const char* of = "");

/// Throws Error(usage) for a library or plugin that is not there: the system's loader would word it
/// in its own way, or look for it elsewhere.
void require_libraries(const DeviceOptions& options);

/// Port that a command listens on: 0 for one that is free, or 1024 to 65535. Throws Error(usage)
/// naming the option.
[[nodiscard]] int listening_port(const std::string& text, const char* option);

/// Date and time in UTC: "2026-01-31T12:00:00Z".
[[nodiscard]] std::string utc_now();

/// Writes a finding of a device to the user while the device is still in use.
void warn_of_finding(const DeviceFinding& finding);

/// Device and real-time settings of the options; to be called when the command runs.
[[nodiscard]] DeviceChoice chosen_device(const DeviceOptions& options);
[[nodiscard]] RealTimeWish chosen_wish(const DeviceOptions& options);

/// The options that name the device, as they were given: " --device omega7".
[[nodiscard]] std::string device_arguments(const DeviceOptions& options);

}  // namespace tpm::app
