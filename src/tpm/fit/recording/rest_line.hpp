#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "tpm/fit/recording/placement.hpp"

namespace tpm::fit {

/// The longest hold, about a straight line and four exponentials: a short rest does not tell how
/// its readings are correlated.
struct HoldSamples {
  std::vector<double> time_s;
  Eigen::VectorXd reading;
  Eigen::MatrixXd curve;
  double step_s = 0.0;    ///< of samples, which phi belongs to
  double variance = 0.0;  ///< of the noise
};

/// A straight line through readings at rest, with noise that is an autoregression of first order.
/// Standard deviations are those of normal distributions whose 95 % intervals are as wide as those
/// of the estimates.
struct RestLine {
  double phi = 0.0;       ///< the most likely one
  double noise_sd = 0.0;  ///< of one reading
  double origin_s = 0.0;  ///< where zero and slope are uncorrelated
  Measured zero;          ///< at origin_s
  std::optional<Measured> slope;
  /// Of the slope, at phi alone where a hold confirms it: whether the slope is told.
  double telling_slope_sd = 0.0;
  /// Standard deviations at the upper end of the 95 % interval of the noise; the stated ones, which
  /// count every phi, where a hold confirms phi.
  double zero_limit = 0.0, slope_limit = 0.0;
};

/// Fits a line, or a level, by generalised least squares. Where the correlation is significant the
/// intervals count every phi that the readings leave possible (possible_autoregressions).
/// @param rounding uncertainty by the rounding of the readings
/// @param hold whose noise is that of the rests; null: the rests alone tell it
[[nodiscard]] RestLine fit_rest_line(const std::vector<double>& time_s,
                                     const std::vector<double>& reading, bool sloped,
                                     double rounding, const HoldSamples* hold);

/// Mean; of at least one value.
[[nodiscard]] double middle_of_rest(std::span<const double> values);

}  // namespace tpm::fit
