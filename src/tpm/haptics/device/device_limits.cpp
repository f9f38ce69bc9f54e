#include "tpm/haptics/device/device_limits.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "tpm/haptics/device/device_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

// Force and reach of the Omega.7: its data sheet. Stiffness and damping: CHAI3D 3.3. All other
// devices have a file in configs/devices.
const DeviceLimits kDeviceLimits[] = {
    {"virtual", "simulated Omega.7", true, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 0, 0.0,
     true},
    {"replay", "replay", true, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 0},
    {"omega7", "omega.7", true, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
};

}  // namespace

std::string_view DeviceLimits::known_by(std::string_view key) const {
  const auto found =
      std::ranges::find_if(provenance, [key](const auto& entry) { return entry.first == key; });
  return found == provenance.end() ? std::string_view("assumed") : found->second;
}

DeviceLimits limits_of(std::string_view kind) {
  for (const DeviceLimits& limits : kDeviceLimits) {
    if (limits.kind != kind) continue;
    DeviceLimits found = limits;
    const bool omega = kind == "omega7" || kind == "virtual";
    if (omega) found.stop_along_x_m = kOmega7StopAlongX_m;
    return found;
  }
  if (const auto file = shipped_device_file(kind)) return limits_in(*file);
  throw Error(ExitCode::usage, "device", "'" + printable(kind) + "'",
              fmt::format("one of {}", fmt::join(device_kinds(), ", ")));
}

std::vector<std::string> device_kinds() {
  std::vector<std::string> kinds;
  for (const DeviceLimits& limits : kDeviceLimits) kinds.emplace_back(limits.kind);
  for (std::string& kind : shipped_devices()) kinds.push_back(std::move(kind));
  return kinds;
}

}  // namespace tpm::haptics
