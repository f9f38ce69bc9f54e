#pragma once
#include <algorithm>
#include <vector>

namespace tpm::base {

/// Of at least one value; the upper of the two middle ones of an even number.
[[nodiscard]] inline double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace tpm::base
