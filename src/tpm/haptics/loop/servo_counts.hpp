#pragma once
#include "tpmkit/servo_loop.hpp"
#include "tpmkit/servo_record.hpp"

namespace tpm::haptics {

/// Adds a recorded cycle to the counts that its flags and its missed periods name.
inline void add_to(ServoCounts& counts, const ServoRecord& row) noexcept {
  const auto flagged = [&row](ServoFlag flag) {
    return static_cast<std::uint64_t>((row.flags & flag) != 0);
  };
  counts.time_guards += flagged(kTimeGuarded);
  counts.saturations += flagged(kSaturated);
  counts.force_limited += flagged(kForceLimited);
  counts.slipped += flagged(kSlipping);
  counts.ramping_in += flagged(kRampingIn);
  counts.damped += flagged(kDamped);
  counts.beyond_model += flagged(kBeyondModel);
  counts.late += flagged(kLate);
  counts.missed += static_cast<std::uint64_t>(row.missed);
}

}  // namespace tpm::haptics
