#pragma once
#include <functional>
#include <memory>
#include <string>

#include "tpm/servo/real_time.hpp"
#include "tpm/servo/servo_step.hpp"

namespace tpm {

/// How a loop went.
struct ServoOutcome {
  StopCause cause = StopCause::none;
  std::string detail;  ///< in words, where there is more to say
  std::uint64_t cycles = 0;
  ServoCounts counts;
  DeviceStatus device;
  std::uint64_t dropped_records = 0;
  std::uint64_t last_beat_cycle = 0;
  // Of a run on the clock only.
  bool real_time = false;
  std::string scheduling;
  TimeHistogram woke_late, busy;
  double stop_took_s = 0.0;  ///< from the fault, or the last sign of life, to forces off
};

/// Gets every record, in order, on a thread of its own in real time. May throw: that stops the
/// loop with the cause `exception`.
using RecordSink = std::function<void(const ServoRecord&)>;

/// Runs a session in virtual time: as fast as it goes, the same bits each time.
/// @param interrupted asked now and then; true ends the session with the cause `signal`
[[nodiscard]] ServoOutcome run_in_virtual_time(HapticDevice& device, ContactModel& model,
                                               const ServoSettings& settings,
                                               const RecordSink& sink,
                                               const std::function<bool()>& interrupted = {});

struct RealTimeOptions {
  RealTimeWish wish = RealTimeWish::ignore;
  double hang_limit_s = 0.008;  ///< a cycle that takes longer is given up
  std::function<bool()> interrupted;
  std::function<void()> idle;  ///< called now and then on the thread of the records
};

/// Runs a session on the clock: deadlines are absolute, a missed one is counted and never made up
/// by slower time. A second thread watches for a cycle that does not end; then the forces are cut
/// from there and the stuck thread is left behind with what it holds, which is why device and
/// model are shared.
/// Throws Error(environment) if real-time scheduling is enforced and refused.
[[nodiscard]] ServoOutcome run_in_real_time(const std::shared_ptr<HapticDevice>& device,
                                            const std::shared_ptr<ContactModel>& model,
                                            const ServoSettings& settings, const RecordSink& sink,
                                            const RealTimeOptions& options);

}  // namespace tpm
