#include "tpm/haptics/loop/oscillation_watch.hpp"

#include <cmath>

namespace tpm::haptics {

void OscillationWatch::observe(double force_N, int periods) noexcept {
  now_ += static_cast<std::uint64_t>(periods);
  const bool beyond = rising_ ? force_N > extreme_N_ : force_N < extreme_N_;
  if (beyond) {
    extreme_N_ = force_N;
    extreme_at_ = now_;
    return;
  }
  if (std::abs(force_N - extreme_N_) < settings_.swing_N) return;
  if (rising_) {
    add({extreme_at_, extreme_N_, extreme_N_ - valley_N_});
  } else {
    valley_N_ = extreme_N_;
  }
  rising_ = !rising_;
  extreme_N_ = force_N;
  extreme_at_ = now_;
}

void OscillationWatch::add(const Peak& peak) noexcept {
  peaks_[count_ % kFast] = peak;
  ++count_;
  found_ = found_ || regular() || fast();
}

bool OscillationWatch::regular() const noexcept {
  if (count_ < kRegular) return false;
  const auto length = static_cast<double>(back(0).time - back(kRegular - 1).time);
  const double mean = length / static_cast<double>(kRegular - 1);
  if (mean * settings_.period_s * settings_.least_Hz > 1.0) return false;
  double swing = 0.0;
  for (std::size_t i = 0; i < kRegular; ++i) swing += back(i).swing_N / double{kRegular};
  for (std::size_t i = 0; i < kRegular; ++i) {
    if (std::abs(back(i).swing_N - swing) > settings_.spread_force * swing) return false;
    if (i + 1 == kRegular) break;
    const auto apart = static_cast<double>(back(i).time - back(i + 1).time);
    // A peak is known to a period.
    if (std::abs(apart - mean) > settings_.spread_time * mean + 1.0) return false;
  }
  // One that dies out is no danger.
  return back(0).swing_N + back(1).swing_N >
         0.9 * (back(kRegular - 2).swing_N + back(kRegular - 1).swing_N);
}

bool OscillationWatch::fast() const noexcept {
  if (count_ < kFast) return false;
  const auto length = static_cast<double>(back(0).time - back(kFast - 1).time);
  if (length * settings_.period_s * settings_.fast_Hz >= double{kFast - 1}) return false;
  double early_N = 0.0, late_N = 0.0;
  for (std::size_t i = 0; i < kFast / 2; ++i) {
    late_N += back(i).swing_N;
    early_N += back(kFast - 1 - i).swing_N;
  }
  return late_N > 0.7 * early_N;
}

}  // namespace tpm::haptics
