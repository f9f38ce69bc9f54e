#include "tpm/fit/recording/carried_noise.hpp"

#include <cmath>
#include <span>
#include <vector>

#include "tpm/data/off_neighbours.hpp"
#include "tpm/fit/likelihood/quantum.hpp"
#include "tpm/fit/recording/motion_before_load.hpp"

namespace tpm::fit {
namespace {

constexpr std::size_t kFewestCarried = 10;

/// Mean variance of the rounding of fitted drive readings, where the noise at rest does not show
/// it: a drive that rests stays on one level. Readings of a level that is held have one error,
/// which no residual shows.
double unseen_rounding(std::span<const double> drive, std::span<const double> fitted,
                       double noise) {
  const RoundedLevels rounded = rounded_levels(drive);
  const double variance = rounded.error_sd() * rounded.error_sd();
  if (!(variance > noise)) return 0.0;
  std::size_t moving = 0;
  for (std::size_t i = 0; i < fitted.size();) {
    std::size_t end = i + 1;
    while (end < fitted.size() && std::abs(fitted[end] - fitted[i]) < 0.5 * rounded.step) ++end;
    if (!RoundedLevel{i, end}.held(fitted.size())) moving += end - i;
    i = end;
  }
  return (variance - noise) * static_cast<double>(moving) / static_cast<double>(fitted.size());
}

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
  const double noise = rest_squares / static_cast<double>(rest.size());
  return stiffness * stiffness * (noise + unseen_rounding(recording.drive, imposed, noise));
}

}  // namespace tpm::fit
