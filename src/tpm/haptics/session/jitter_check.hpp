#pragma once
#include "tpm/haptics/session/session_run.hpp"

namespace tpm::haptics {

/// Answer of the gate of `tpm hil run` to a session on a device.
struct SessionVerdict {
  std::string title;
  bool accepted = false;
  std::string words;  ///< the rendering; of a session that is refused the message of the refusal
  std::optional<RenderingCheck> rendering;    ///< of a session that is accepted
  std::optional<RenderingCheck> on_hardware;  ///< as in SessionRun
  std::string hardware_kind;                  ///< as in SessionRun
};

/// Result of a communication and jitter test.
struct JitterCheck {
  DeviceIdentity device;
  double rate_Hz = 0.0, duration_s = 0.0;
  double watchdog_s = 0.0, cycle_timeout_s = 0.0;  ///< of the sessions that it speaks for
  int late_limit = 0, missed_limit = 0;            ///< as ServoSettings::most_late, most_missed
  ServoOutcome outcome;
  std::vector<DeviceFinding> findings;  ///< of the device
  bool timing_kept = false;
  std::string timing;  ///< whether the rate was kept, and for how long; or why not: one line
  std::string advice;  ///< what this machine can do and what to change, one sentence
  std::optional<SessionVerdict> session;  ///< of the session that was named; empty: none was
};

/// The rates that are tried for a sentence about what a machine can do, Hz.
inline constexpr double kSessionRates_Hz[] = {4000.0, 2000.0, 1000.0, 500.0};

/// True if a cycle did not end: how long it would have taken is not known, so nothing is said of
/// how often the loop stalls.
[[nodiscard]] bool hung(const JitterCheck& check);

/// Wake-ups so late that the watchdog would have ended a session: with the period before it, the
/// lateness is as long as the watchdog waits.
[[nodiscard]] std::uint64_t stalls_beyond_watchdog(const JitterCheck& check);

/// Upper limit of those stalls a second at 95 %: of a Poisson count, 3/T where there was none in
/// the time T. Empty if no wake-up was counted, or a cycle hung.
[[nodiscard]] std::optional<double> most_stalls_per_s(const JitterCheck& check);

/// That limit in words, with how it was found; empty without one.
[[nodiscard]] std::string stall_bound(const JitterCheck& check);

/// Time that was observed, s.
[[nodiscard]] double observed_s(const JitterCheck& check);

/// Lateness of a wake-up that is exceeded once an hour, s: an extrapolation, not a measurement.
/// The tail beyond 99.9 % is taken as exponential; never less than the largest that was seen. Empty
/// if fewer than kFewestToExtrapolate cycles were counted, or a cycle hung.
[[nodiscard]] std::optional<double> once_an_hour_s(const JitterCheck& check);
inline constexpr std::uint64_t kFewestToExtrapolate = 20'000;

/// Fills timing_kept, timing and advice from the outcome and the limits. Kept if a session with
/// these limits would have come to its end: the wake-up of 99 % of the cycles was late by less than
/// half a period, less than 1 % of the periods were missed, neither the longest stall, nor the work
/// of a cycle, nor the periods missed at once, nor the late cycles of any thousand reached a limit,
/// and once_an_hour_s() is below the watchdog too. It says nothing of a session's tissue.
void assess(JitterCheck& check);

/// Runs the servo loop on the clock with forces of zero, with the rate, watchdog, limit of a
/// hanging cycle and limits of lateness of a session: does this machine, with this device, keep the
/// time? Goes on to the end whatever is late, unless the device's watchdog cuts it off or a cycle
/// hangs for the session's cycle_timeout_s; the simulated device forgives a second
/// (forgive_stalls()). Throws as run_session() does, also for a file of another device.
/// @param noticed as SessionRunOptions::noticed
[[nodiscard]] JitterCheck check_jitter(const DeviceChoice& device, const HilSession& session,
                                       double duration_s, RealTimeWish wish,
                                       const std::function<bool()>& interrupted = {},
                                       const FindingTold& noticed = {});

/// Asks the gate of run_session() in real time (admit_session(), also its check of a second).
/// @param told see make_loop_model()
/// Throws as run_session() before its loop begins; a session that is refused is an answer.
[[nodiscard]] SessionVerdict ask_session_gate(const HilSession& session, const DeviceChoice& device,
                                              RealTimeWish wish,
                                              const std::function<bool()>& interrupted = {},
                                              const PlanningTold& told = {});

}  // namespace tpm::haptics
