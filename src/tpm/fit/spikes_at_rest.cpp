#include "tpm/fit/spikes_at_rest.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::fit {

std::vector<bool> spikes_at_rest(std::span<const double> reading) {
  constexpr std::size_t kFewest = 8, kOneIn = 5;
  constexpr double kFar = 8.0, kOfMedian = 1.4826;
  const std::size_t n = reading.size();
  std::vector<bool> spikes(n, false);
  if (n < kFewest) return spikes;
  const double middle = median({reading.begin(), reading.end()});
  std::vector<double> off(n);
  for (std::size_t i = 0; i < n; ++i) off[i] = std::abs(reading[i] - middle);
  const double far = kFar * kOfMedian * median(std::vector<double>(off));
  if (!(far > 0.0)) return spikes;
  for (std::size_t i = 0; i < n; ++i) {
    const bool alone = (i == 0 || off[i - 1] <= far) && (i + 1 == n || off[i + 1] <= far);
    spikes[i] = off[i] > far && alone;
  }
  const auto count = static_cast<std::size_t>(std::ranges::count(spikes, true));
  if (kOneIn * count > n) spikes.assign(n, false);
  return spikes;
}

std::vector<double> without_spikes(std::span<const double> time_s,
                                   std::span<const double> reading) {
  constexpr std::size_t kFewest = 20;
  constexpr double kFar = 8.0, kOfMedian = 1.4826, kHalf = 0.25;
  std::vector<double> clean(reading.begin(), reading.end());
  const std::size_t n = reading.size();
  if (n < kFewest) return clean;
  const auto line = [&](std::size_t i) {
    const double share = (time_s[i] - time_s[i - 1]) / (time_s[i + 1] - time_s[i - 1]);
    return reading[i - 1] + share * (reading[i + 1] - reading[i - 1]);
  };
  std::vector<double> off(n, 0.0), sizes;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    off[i] = reading[i] - line(i);
    sizes.push_back(std::abs(off[i]));
  }
  const double far = kFar * kOfMedian * median(std::move(sizes));
  if (!(far > 0.0)) return clean;
  for (std::size_t i = 2; i + 2 < n; ++i) {
    const bool both = off[i - 1] * off[i] < -kHalf * off[i] * off[i] &&
                      off[i + 1] * off[i] < -kHalf * off[i] * off[i];
    if (std::abs(off[i]) > far && both) clean[i] = line(i);
  }
  return clean;
}

}  // namespace tpm::fit
