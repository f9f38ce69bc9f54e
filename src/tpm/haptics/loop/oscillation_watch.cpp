#include "tpm/haptics/loop/oscillation_watch.hpp"

#include <algorithm>
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
  if (std::abs(force_N - extreme_N_) < settings_.turn_N) return;
  add({extreme_at_ - turned_at_, std::abs(extreme_N_ - turned_N_)});
  turned_at_ = extreme_at_;
  turned_N_ = extreme_N_;
  rising_ = !rising_;
  extreme_N_ = force_N;
  extreme_at_ = now_;
}

void OscillationWatch::add(const Stroke& stroke) noexcept {
  strokes_[count_ % kFast] = stroke;
  ++count_;
  found_ =
      found_ || grows(kGrowing) || steady(kSteady) || (steady(kEqual) && equal(kEqual)) || fast();
}

bool OscillationWatch::grows(std::size_t strokes) const noexcept {
  if (count_ < strokes) return false;
  const double longest = settings_.longest_stroke_s / settings_.period_s;
  for (std::size_t i = 0; i < strokes; ++i) {
    if (static_cast<double>(back(i).periods) > longest) return false;
    if (i + 2 < strokes && back(i).swing_N < settings_.growth * back(i + 2).swing_N) return false;
  }
  return true;
}

bool OscillationWatch::steady(std::size_t strokes) const noexcept {
  if (count_ < strokes) return false;
  double length = 0.0;
  for (std::size_t i = 0; i < strokes; ++i) {
    if (back(i).swing_N < settings_.swing_N) return false;
    length += static_cast<double>(back(i).periods);
  }
  const double mean = 2.0 * length / static_cast<double>(strokes);  // of a cycle
  if (mean > 2.0 * settings_.longest_stroke_s / settings_.period_s) return false;
  for (std::size_t i = 0; i + 1 < strokes; ++i) {
    const auto cycle = static_cast<double>(back(i).periods + back(i + 1).periods);
    // A peak is known to a period.
    if (std::abs(cycle - mean) > settings_.spread_time * mean + 1.0) return false;
  }
  return stays(strokes);
}

bool OscillationWatch::equal(std::size_t strokes) const noexcept {
  double mean_N = 0.0;
  for (std::size_t i = 0; i < strokes; ++i) {
    mean_N += back(i).swing_N / static_cast<double>(strokes);
  }
  for (std::size_t i = 0; i < strokes; ++i) {
    if (std::abs(back(i).swing_N - mean_N) > settings_.spread_force * mean_N) return false;
  }
  return true;
}

bool OscillationWatch::fast() const noexcept {
  if (count_ < kFast) return false;
  double length = 0.0;
  for (std::size_t i = 0; i < kFast; ++i) {
    if (back(i).swing_N < settings_.swing_N) return false;
    length += static_cast<double>(back(i).periods);
  }
  if (2.0 * length * settings_.period_s * settings_.fast_Hz >= double{kFast}) return false;
  return stays(kFast);
}

/// The later half of the strokes is not smaller than the earlier one.
bool OscillationWatch::stays(std::size_t strokes) const noexcept {
  double early_N = 0.0, late_N = 0.0;
  for (std::size_t i = 0; i < strokes / 2; ++i) {
    late_N += back(i).swing_N;
    early_N += back(strokes - 1 - i).swing_N;
  }
  return late_N > settings_.decay * early_N;
}

}  // namespace tpm::haptics
