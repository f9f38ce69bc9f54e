#include "tpm/fit/recording/prepared_recording.hpp"

#include "tpm/base/median.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::fit {

double median_step(std::span<const double> time_s) {
  std::vector<double> steps;
  steps.reserve(time_s.size());
  for (std::size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
  return median(std::move(steps));
}

}  // namespace tpm::fit
