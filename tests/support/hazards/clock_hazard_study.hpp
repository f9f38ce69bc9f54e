#pragma once
#include <string>
#include <vector>

#include "tpmkit/servo_record.hpp"

namespace tpm::haptics {

/// Outcome of one hazard on the clock: the loop with its threads, the simulated device.
struct ClockHazardRow {
  std::string hazard, setting;
  StopCause expected = StopCause::none;  ///< what it should end in
  StopCause cause = StopCause::none;
  int consecutive_missed = 0;    ///< most periods without a cycle
  double largest_force_N = 0.0;  ///< sent
  double to_zero_s = 0.0;        ///< from the fault to forces off; of sessions that were stopped
  double bound_s = 0.0;          ///< for that
  double lasts_s = 0.0;          ///< the call that hangs
  int tries = 0;                 ///< until one was within bounds, or ended as it should
  bool by_fault = false;         ///< the last try came to its fault; to_zero_s is known
  bool forces_off = true;        ///< at the end of each try
  bool within = false;           ///< the expected end, in time, forces within the limit
};

struct ClockHazardStudy {
  std::string scheduling;  ///< what the system granted to the loop's thread
  double force_limit_N = 0.0;
  int most_tries = 0;
  std::vector<ClockHazardRow> rows;
  [[nodiscard]] bool safe() const;
};

/// Hazards that take time of their own: calls and models that hang, slow calls, the device's
/// watchdog, interruptions, records that cannot be kept. Times differ from run to run, and other
/// programs on the machine may stall a session as well: a row is tried again, up to `most_tries`.
/// @param in_time until it is within its bounds; else until it ends as it should, however long that
///        takes, which a busy machine can do too
[[nodiscard]] ClockHazardStudy study_hazards_on_the_clock(bool in_time);

}  // namespace tpm::haptics
