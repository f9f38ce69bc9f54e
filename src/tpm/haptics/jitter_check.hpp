#pragma once
#include "tpm/haptics/session_run.hpp"

namespace tpm {

/// What a communication and jitter test has found.
struct JitterCheck {
  DeviceIdentity device;
  double rate_Hz = 0.0, duration_s = 0.0;
  ServoOutcome outcome;
  bool fit = false;
  std::string verdict;  ///< one line
};

/// Runs the servo loop on the clock with forces of zero: is this machine, with this device, up to a
/// session? Fit if the loop came to its end, the wake-up of 99 % of the cycles was late by less
/// than half a period, and less than 1 % of the periods were missed.
/// Throws as run_session does.
[[nodiscard]] JitterCheck check_jitter(const DeviceChoice& device, double rate_Hz,
                                       double duration_s, RealTimeWish wish,
                                       const std::function<bool()>& interrupted = {});

}  // namespace tpm
