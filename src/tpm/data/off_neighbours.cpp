#include "tpm/data/off_neighbours.hpp"

#include <cmath>
#include <cstddef>

namespace tpm::data {

std::vector<double> off_neighbours(std::span<const double> time, std::span<const double> values) {
  std::vector<double> off;
  for (std::size_t i = 1; i + 1 < values.size(); ++i) {
    const double share = (time[i] - time[i - 1]) / (time[i + 1] - time[i - 1]);
    off.push_back((values[i] - values[i - 1] - share * (values[i + 1] - values[i - 1])) /
                  std::sqrt(1.0 + share * share + (1.0 - share) * (1.0 - share)));
  }
  return off;
}

}  // namespace tpm::data
