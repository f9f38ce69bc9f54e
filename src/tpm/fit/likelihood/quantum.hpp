#pragma once
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace tpm::fit {

class ExperimentResiduals;

/// Step between neighbouring levels of readings that were rounded to a grid; 0 if there is none.
[[nodiscard]] double quantum_of(std::span<const double> readings);

/// Below this variance, in squares of half a step, the noise of rounded readings is smaller than
/// half a step by more than chance (5 %) explains. Rounding itself is a part of the variance.
/// @param degrees independent readings behind the variance
[[nodiscard]] double hidden_noise_variance(double degrees);

/// Successive readings `first` to before `end` that were rounded to the same level.
struct RoundedLevel {
  std::size_t first = 0, end = 0;

  [[nodiscard]] std::size_t size() const { return end - first; }
  /// True for a level of more than a twentieth of `count` readings: no motion passes it.
  [[nodiscard]] bool held(std::size_t count) const {
    constexpr std::size_t kHold = 20;
    return kHold * size() > count;
  }
};

/// A drive that was rounded to coarse steps.
struct RoundedLevels {
  double step = 0.0;                 ///< q; 0: it was not
  std::vector<RoundedLevel> levels;  ///< of all readings, in their order

  /// q / sqrt(12), of the error of a level.
  [[nodiscard]] double error_sd() const { return step / std::sqrt(12.0); }
  /// The same of the mean error of a level among `count` readings: errors of n readings of a level
  /// that a motion passes are spread evenly over the step, which leaves q / (n sqrt(12)).
  [[nodiscard]] double error_sd(const RoundedLevel& level, std::size_t count) const {
    return error_sd() / (level.held(count) ? 1.0 : static_cast<double>(level.size()));
  }
};

/// The steps of a drive that was rounded: its readings lie on a grid of at least 1e-4 of its range,
/// it passes at least 20 different levels (each for less than a twentieth of the readings), and at
/// least a fifth of these hold several readings. Fewer may be stairs or cycles that were imposed;
/// and a drive that passes another level with every reading need not be rounded, though it may lie
/// on a grid, as an exact ramp does.
[[nodiscard]] RoundedLevels rounded_levels(std::span<const double> readings);

/// Relative error of a reading by computing: responses and minima are exact to about 1e-10, and no
/// instrument reads nine digits.
constexpr double kComputedShare = 1e-9;

/// Mean square of that error of the values, in units of the declared noise: the least variance that
/// an estimate of the noise can mean.
[[nodiscard]] double computed_variance(const ExperimentResiduals& function);

}  // namespace tpm::fit
