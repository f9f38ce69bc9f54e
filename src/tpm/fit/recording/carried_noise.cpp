#include "tpm/fit/recording/carried_noise.hpp"

#include <cmath>
#include <span>
#include <vector>

#include "tpm/data/off_neighbours.hpp"
#include "tpm/fit/recording/motion_before_load.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kFewestCarried = 10;

}  // namespace

double carried_variance(const RecordingFit& fit, const Recording& recording, std::size_t at_rest) {
  if (at_rest < kFewestCarried) return 0.0;
  std::vector<double> time, imposed, answer;
  for (std::size_t i = 0; i < fit.time_s.size() && i < recording.drive.size(); ++i) {
    if (!fit.fitted[i] || !std::isfinite(fit.predicted[i])) continue;
    time.push_back(fit.time_s[i]);
    imposed.push_back(recording.drive[i]);
    answer.push_back(fit.predicted[i]);
  }
  const std::vector<double> bends = data::off_neighbours(time, imposed);
  const std::vector<double> answers = data::off_neighbours(time, answer);
  double squares = 0.0, products = 0.0;
  for (std::size_t i = 0; i < bends.size(); ++i) {
    squares += bends[i] * bends[i];
    products += bends[i] * answers[i];
  }
  const std::size_t still = still_samples(recording, at_rest);
  double rest_squares = 0.0;
  const std::vector<double> rest = data::off_neighbours(std::span(recording.time_s).first(still),
                                                        std::span(recording.drive).first(still));
  for (const double off : rest) rest_squares += off * off;
  if (!(squares > 0.0)) return 0.0;
  const double stiffness = products / squares;
  return stiffness * stiffness * rest_squares / static_cast<double>(rest.size());
}

}  // namespace tpm::fit
