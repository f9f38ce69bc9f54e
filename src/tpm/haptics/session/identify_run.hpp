#pragma once
#include "tpm/haptics/session/device_identification.hpp"
#include "tpm/haptics/session/session_run.hpp"

namespace tpm::haptics {

struct DeviceIdentifyOptions {
  double duration_s = 20.0;
  bool real_time = false;
  RealTimeWish wish = RealTimeWish::ignore;
  std::uint64_t seed = 1;  ///< of the edges of the force
  std::function<bool()> interrupted;
  /// Called when the device is open and its forces are still off; what it throws ends the run.
  std::function<void(const DeviceIdentity&)> opened;
  /// Told once for each finding of the device, in real time when it is noticed.
  FindingTold noticed;
  /// Sees every record, also those of the wait for the handle, on the thread that writes them.
  std::function<void(const ServoRecord&)> watcher;
};

/// Measurements of `tpm hil identify`.
struct IdentifyRun {
  DeviceIdentity device;
  DeviceLimits limits;  ///< of it, as limits_of() says
  DeviceIdentification found;
  ServoOutcome outcome;                     ///< of the last part; missed periods and cycles of all
  double period_s = 0.0, duration_s = 0.0;  ///< asked for
  double measured_s = 0.0;                  ///< of it
  std::string ended_by;                     ///< why less was measured; empty: nothing is missing
  /// False if less than kLeastMeasured_s was measured because it ended early: nothing is
  /// identified.
  bool counts = true;
  std::vector<DeviceFinding> findings;  ///< of the device
  /// Ends by a stall, after each of which the measurement went on with a new connection.
  int begun_again = 0;
  bool real_time = false;
};

/// Moves the handle of a device with forces below 0.3 N along the push of a session, and finds what
/// device_identification.hpp lists. Nothing is taken from what the device or its simulation says of
/// itself. The handle has to be free; forces begin when it is at rest within identifying_reach_m()
/// of the middle. Stretches in which loop or device stalled are left out. A stall that ends the
/// loop, as a watchdog, a lost connection or a call that hangs does, is one too: the device is
/// opened again, up to kMostBegunAgain times. Of a measurement that ends early, what was measured
/// until then is used if that is kLeastMeasured_s or more.
/// @param like rate, push, watchdog, longest cycle and force limit; of the simulated device also
/// its
///        numbers. Its operator lets go, unless the session states another arm than ArmSettings{}.
/// Throws Error(environment) as a session does if the device does not open; Error(bad_input) or,
/// without a device file, Error(environment) if it has no room or no force for the measurement. An
/// early end is in the outcome and in `ended_by`.
[[nodiscard]] IdentifyRun run_identification(const DeviceChoice& choice, const HilSession& like,
                                             const DeviceIdentifyOptions& options);
inline constexpr int kMostBegunAgain = 9;
inline constexpr double kLeastMeasured_s = 5.0;
inline constexpr double kLeastIdentifyingForce_N = 0.2;
inline constexpr double kLongestStroke_m = 0.020;  ///< from the start; no force is sent beyond it
/// Distance from the middle of the workspace at which the handle may begin, at most.
[[nodiscard]] double identifying_reach_m(const DeviceLimits& limits);
/// The same on devices of the caller's. @param make called before each beginning
using MakesDevice = std::function<std::shared_ptr<HapticDevice>()>;
[[nodiscard]] IdentifyRun run_identification_on(const MakesDevice& make, const DeviceChoice& choice,
                                                const HilSession& like,
                                                const DeviceIdentifyOptions& options);

/// Outcome of the check of one second at the start of a session.
struct DelayCheck {
  std::optional<double> delay_s;  ///< both paths together, see checked_delay_s(); empty: not found
};
/// Measures the delay of a device for a second with the forces of the identification, once the
/// handle is in place and at rest; a hand may hold it, but not move it. The device is closed
/// afterwards. Throws as run_identification(), and Error(environment) with the cause if it ends
/// early.
[[nodiscard]] DelayCheck check_delay(const std::shared_ptr<HapticDevice>& device,
                                     const DeviceChoice& choice, const HilSession& like,
                                     const DeviceIdentifyOptions& options);
inline constexpr double kDelayCheck_s = 1.0;

/// A device file (schemas/device.schema.json). That of a plugin has the limits that the plugin
/// states, so that limits_from() needs no plugin. @param date of the measurement; may be empty
[[nodiscard]] Json device_file_json(const IdentifyRun& run, const std::string& date);

}  // namespace tpm::haptics
