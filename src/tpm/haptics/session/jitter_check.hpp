#pragma once
#include "tpm/haptics/session/session_run.hpp"

namespace tpm::haptics {

/// Result of a communication and jitter test.
struct JitterCheck {
  DeviceIdentity device;
  double rate_Hz = 0.0, duration_s = 0.0;
  double watchdog_s = 0.0, cycle_timeout_s = 0.0;  ///< of the sessions that it speaks for
  int late_limit = 0, missed_limit = 0;            ///< as ServoSettings::most_late, most_missed
  ServoOutcome outcome;
  bool fit = false;
  std::string verdict;  ///< one line
  std::string advice;   ///< what this machine can do and what to change, one sentence
};

/// The rates that are tried for a sentence about what a machine can do, Hz.
inline constexpr double kSessionRates_Hz[] = {4000.0, 2000.0, 1000.0, 500.0};

/// Fills fit, verdict and advice from the outcome and the limits. Fit if a session with these
/// limits would have come to its end: the wake-up of 99 % of the cycles was late by less than half
/// a period, less than 1 % of the periods were missed, and neither the longest stall, nor the work
/// of a cycle, nor the periods missed at once, nor the late cycles of any thousand reached a limit.
void assess(JitterCheck& check);

/// Runs the servo loop on the clock with forces of zero, with the rate, watchdog, limit of a
/// hanging cycle and limits of lateness of a session: is this machine, with this device, up to it?
/// Goes on to the end whatever is late, unless the device's watchdog cuts it off; that of the
/// simulated one forgives a second (forgive_stalls()). Throws as
/// run_session does.
[[nodiscard]] JitterCheck check_jitter(const DeviceChoice& device, const HilSession& session,
                                       double duration_s, RealTimeWish wish,
                                       const std::function<bool()>& interrupted = {});

}  // namespace tpm::haptics
