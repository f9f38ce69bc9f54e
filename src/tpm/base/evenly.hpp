#pragma once
#include <cmath>
#include <vector>

namespace tpm::base {

/// So many values from `from` to `to`, evenly in the logarithm; one alone lies in the middle.
[[nodiscard]] inline std::vector<double> evenly_in_log(double from, double to, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    const double share = count > 1 ? static_cast<double>(i) / (count - 1) : 0.5;
    values.push_back(from * std::pow(to / from, share));
  }
  return values;
}

}  // namespace tpm::base
