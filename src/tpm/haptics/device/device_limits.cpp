#include "tpm/haptics/device/device_limits.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

// Force and reach of the Omega.7: its data sheet. Stiffness and damping of omega, lambda and
// Falcon: CHAI3D 3.3. All else of the others is assumed, and no higher than that of the Omega.7.
// The reach of the Inverse3 is that of its maker's tutorials, 0.08 to 0.10 m; no data sheet was
// found.
constexpr DeviceLimits kDeviceLimits[] = {
    {"virtual", "simulated Omega.7", true, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 0, 0.0,
     true},
    {"replay", "replay", true, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 0},
    {"omega7", "omega.7", true, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"omega3", "omega.3", false, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"omega6", "omega.6", false, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"delta3", "delta.3", false, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"sigma3", "sigma.3", false, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"sigma7", "sigma.7", false, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"lambda3", "lambda.3", false, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"lambda6", "lambda.6", false, 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"lambda7", "lambda.7", false, 12.0, 0.075, 8000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"inverse3", "Inverse3", false, 4.0, 0.08, 1000.0, 5.0, 700.0, 0.1, 0.0, 1},
    {"falcon", "Falcon", false, 8.0, 0.05, 3000.0, 20.0, 1000.0, 0.1, 0.1, 1},
};

}  // namespace

const DeviceLimits& limits_of(std::string_view kind) {
  for (const DeviceLimits& limits : kDeviceLimits) {
    if (limits.kind == kind) return limits;
  }
  throw Error(ExitCode::usage, "--device", "'" + printable(kind) + "'",
              fmt::format("one of {}", fmt::join(device_kinds(), ", ")));
}

std::vector<std::string> device_kinds() {
  std::vector<std::string> kinds;
  for (const DeviceLimits& limits : kDeviceLimits) kinds.emplace_back(limits.kind);
  return kinds;
}

}  // namespace tpm::haptics
