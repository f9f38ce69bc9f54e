#pragma once
// Checks of servo cycles without a device, for what is said of them.
#include <cstdint>

#include "tpm/haptics/session/jitter_check.hpp"

namespace tpm::test {

/// A check at this rate, with the limits of a session, that came to its end: to be filled with
/// wake-ups and assessed.
inline haptics::JitterCheck made_check(double rate_Hz = 1000.0) {
  haptics::JitterCheck check;
  check.rate_Hz = rate_Hz;
  check.watchdog_s = check.cycle_timeout_s = 8.0 / rate_Hz;
  check.late_limit = 100;
  check.missed_limit = 50;
  check.outcome.cause = haptics::StopCause::finished;
  return check;
}

/// Wake-ups that were late by as much, each a cycle.
inline void add_cycles(haptics::JitterCheck& check, int count, std::int64_t late_ns) {
  check.outcome.cycles += static_cast<std::uint64_t>(count);
  for (int i = 0; i < count; ++i) check.outcome.woke_late.note(late_ns);
}

}  // namespace tpm::test
