#pragma once
#include <cmath>
#include <string_view>

namespace tpm::base {

/// Times of experiments lie within this of 0, s: 30 million years. Beyond it no number is a time
/// that somebody measured or wants simulated, but a slip of the unit or a damaged file, and
/// intervals of it overflow in the solvers.
inline constexpr double kLongestTime_s = 1e15;
inline constexpr std::string_view kTimeRange = "times within 1e15 s of 0";

[[nodiscard]] inline bool is_time_in_range(double time_s) noexcept {
  return std::abs(time_s) <= kLongestTime_s;
}

}  // namespace tpm::base
