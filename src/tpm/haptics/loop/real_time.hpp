#pragma once
#include <cstdint>
#include <string>

#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {

/// CLOCK_MONOTONIC, ns.
[[nodiscard]] std::int64_t now_ns() noexcept;

/// UTC of an instant of now_ns(), to a millisecond: "2026-11-27T19:15:00.123Z".
[[nodiscard]] std::string utc_of(std::int64_t instant_ns);

/// Sleeps until an instant of now_ns().
void sleep_until_ns(std::int64_t instant_ns) noexcept;

/// Locks the memory of the process and gives this thread SCHED_FIFO. Returns what was granted and
/// what a refusal means, one line. Throws Error(environment) under `enforce`.
[[nodiscard]] std::string become_real_time(RealTimeWish wish);

/// While it lives, this thread has a higher priority than the loop's, where the system allows that.
/// For whoever watches the loop: among other programs a thread of usual priority wakes too late to
/// cut the forces.
class AboveRealTime {
 public:
  AboveRealTime() noexcept;
  ~AboveRealTime();
  AboveRealTime(const AboveRealTime&) = delete;
  AboveRealTime& operator=(const AboveRealTime&) = delete;

 private:
  int policy_ = 0, priority_ = 0;  ///< as they were
  bool raised_ = false;
};

/// Kernel, processor and number of cores, one line.
[[nodiscard]] std::string host_line();

}  // namespace tpm::haptics
