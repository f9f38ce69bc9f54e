#include "tpm/device/device_limits.hpp"

#include "tpm/core/error.hpp"

namespace tpm {
namespace {

constexpr DeviceLimits kDeviceLimits[] = {
    {"omega7", 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 1},
    {"virtual", 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 0},
    {"replay", 12.0, 0.075, 5000.0, 30.0, 2000.0, 0.1, 0.1, 0},
};

}  // namespace

const DeviceLimits& limits_of(std::string_view kind) {
  for (const DeviceLimits& limits : kDeviceLimits) {
    if (limits.kind == kind) return limits;
  }
  throw Error(ExitCode::usage, "--device", "'" + printable(kind) + "'",
              "virtual, omega7 or replay");
}

}  // namespace tpm
