#pragma once
#include "command.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/session/session_run.hpp"

namespace tpm::app {

/// Options that every command with a device has.
struct DeviceOptions {
  DeviceChoice choice;
  std::string library, replay, plugin, file;
  int serial = -1, index = -1;  ///< -1: not given
  std::string real_time = "ignore";
};

/// Adds --device, --serial, --index, --dhd-library, --device-recording, --may-move and
/// --take-as-ready.
void add_device_options(CLI::App& command, DeviceOptions& options);

/// What was chosen; call when the command runs.
[[nodiscard]] DeviceChoice chosen_device(const DeviceOptions& options);
[[nodiscard]] RealTimeWish chosen_wish(const DeviceOptions& options);

}  // namespace tpm::app
