#include "tpm/fit/residual_jumps.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "tpm/base/median.hpp"

namespace tpm::fit {
namespace {

double squares_of(std::span<const double> values) {
  return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
}

double mean_residual(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Values first, first + 1, ... that are all off the line between those beside them by more than 8
/// robust standard deviations on one side, while those are near their own neighbours.
std::optional<ResidualSpike> spike_at(std::span<const double> values, std::size_t first,
                                      std::size_t length, double far) {
  constexpr double kNear = 0.25;  // of the spike
  const double before = values[first - 1], after = values[first + length];
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (std::size_t k = 0; k < length; ++k) {
    const double share = static_cast<double>(k + 1) / static_cast<double>(length + 1);
    const double off = values[first + k] - before - share * (after - before);
    least = std::min(least, off);
    most = std::max(most, off);
  }
  const double size = least > 0.0 ? least : most < 0.0 ? -most : 0.0;
  const double near = kNear * size;
  const bool alone = std::abs(before - values[first - 2]) < near &&
                     std::abs(after - values[first + length + 1]) < near &&
                     std::abs(after - before) < near;
  if (size <= far || !alone) return std::nullopt;
  return ResidualSpike{first, length, std::max(most, -least)};
}

}  // namespace

std::optional<ResidualSpike> spike_in(std::span<const double> residual) {
  constexpr std::size_t kFewest = 20, kLongest = 2;
  constexpr double kFar = 8.0, kOfMedian = 1.4826, kMost = 0.5;
  if (residual.size() < kFewest) return std::nullopt;
  std::vector<double> off;
  for (std::size_t i = 1; i + 1 < residual.size(); ++i) {
    off.push_back(std::abs(residual[i] - 0.5 * (residual[i - 1] + residual[i + 1])));
  }
  const double far = kFar * kOfMedian * base::median(std::move(off));
  const double all = squares_of(residual);
  for (std::size_t length = 1; far > 0.0 && length <= kLongest; ++length) {
    for (std::size_t i = 2; i + length + 1 < residual.size(); ++i) {
      const auto spike = spike_at(residual, i, length, far);
      if (spike && squares_of(residual.subspan(i, length)) > kMost * all) return spike;
    }
  }
  return std::nullopt;
}

std::optional<ResidualJump> jump_under_load(std::span<const double> time_s,
                                            std::span<const double> residual, double ramp_to_s,
                                            double noise_sd) {
  constexpr std::size_t kAround = 5;            // samples on each side
  constexpr double kFar = 20.0;                 // standard deviations of the noise
  constexpr double kAlone = 4.0, kStays = 0.5;  // times the steps around it; of the jump
  const auto hold =
      static_cast<std::size_t>(std::ranges::upper_bound(time_s, ramp_to_s) - time_s.begin());
  std::optional<ResidualJump> largest;
  for (std::size_t i = hold + 2 * kAround; i + kAround < residual.size(); ++i) {
    const double step = residual[i] - residual[i - 1];
    if (std::abs(step) <= kFar * noise_sd) continue;
    if (largest && std::abs(step) <= std::abs(largest->by)) continue;
    double around = 0.0;
    for (std::size_t k = 1; k < kAround; ++k) {
      around = std::max({around, std::abs(residual[i + k] - residual[i + k - 1]),
                         std::abs(residual[i - k] - residual[i - k - 1])});
    }
    const double stays = (mean_residual(residual.subspan(i, kAround)) -
                          mean_residual(residual.subspan(i - kAround, kAround))) /
                         step;
    if (std::abs(step) > kAlone * around && stays > kStays) largest = ResidualJump{time_s[i], step};
  }
  return largest;
}

}  // namespace tpm::fit
