#include "tpm/data/off_neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::data {

std::vector<double> off_neighbours(std::span<const double> time, std::span<const double> values) {
  std::vector<double> off;
  for (std::size_t i = 1; i + 1 < values.size(); ++i) {
    const double share = (time[i] - time[i - 1]) / (time[i + 1] - time[i - 1]);
    const double rest = 1.0 - share;
    off.push_back((values[i] - rest * values[i - 1] - share * values[i + 1]) /
                  std::sqrt(1.0 + rest * rest + share * share));
  }
  return off;
}

double noise_of(std::vector<double> off) {
  constexpr double kMedianToSd = 1.482602218505602;  // of a normal distribution
  if (off.empty()) return 0.0;
  for (double& distance : off) distance = std::abs(distance);
  return kMedianToSd * median(std::move(off));
}

double noise_about_neighbours(std::span<const double> time, std::span<const double> values) {
  constexpr double kComputed = 1e-13;  // of the largest value
  const double noise = noise_of(off_neighbours(time, values));
  double largest = 0.0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return noise > kComputed * largest ? noise : 0.0;
}

}  // namespace tpm::data
