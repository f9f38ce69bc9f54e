#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace tpm {

/// What to do where the system refuses real-time scheduling.
enum class RealTimeWish {
  enforce,  ///< an error
  ignore,   ///< go on, and say so
};

/// CLOCK_MONOTONIC, ns.
[[nodiscard]] std::int64_t now_ns() noexcept;

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

/// Counts times in bins of 1 us up to 50 ms. note() neither allocates nor throws.
class TimeHistogram {
 public:
  TimeHistogram();
  void note(std::int64_t ns) noexcept;
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] double max_s() const noexcept { return static_cast<double>(max_ns_) * 1e-9; }
  /// Upper edge of the bin in which that share of the times ends, s; max_s() beyond the bins.
  [[nodiscard]] double quantile_s(double share) const;
  /// Counts of the bins.
  [[nodiscard]] const std::vector<std::uint32_t>& bins() const { return bins_; }

 private:
  std::vector<std::uint32_t> bins_;
  std::uint64_t count_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace tpm
