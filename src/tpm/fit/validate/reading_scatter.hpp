#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>

#include "tpm/fit/validate/functional.hpp"

namespace tpm::fit {

/// Scatter of the readings of one recording, from this recording alone: normal noise of standard
/// deviation sigma with the correlation phi^(dt / step) between samples dt apart.
struct ReadingScatter {
  double sigma = 0.0;  ///< SI of the response
  double phi = 0.0;    ///< of neighbours, 0 to below 1
  double step_s = 1.0;
  double degrees = 1.0;   ///< of freedom of sigma^2: independent readings less one
  std::size_t count = 0;  ///< readings that told it
  std::string told_by;    ///< "the hold", "before contact", "the ramp"

  /// Standard uncertainty of a sum of readings with these weights.
  [[nodiscard]] double of(std::span<const double> time_s, const Eigen::VectorXd& weight) const;
  /// Covariance of several such sums, one a column: sigma^2 W' R W. O(n) each.
  [[nodiscard]] Eigen::MatrixXd covariance(std::span<const double> time_s,
                                           const Eigen::MatrixXd& weights) const;
};

/// From the longest stretch that tells it: the hold's residuals about a smooth curve that is fitted
/// to this recording alone (a constant and up to four decaying exponentials, taken in by BIC from
/// times that are a factor of two apart; where the drive does not stay, as under a hand, also the
/// drive and its fading memories), never about a prediction; without a hold the readings
/// before contact about their mean, or the ramp about a polynomial. phi and sigma by restricted
/// maximum likelihood (estimate_autoregression). Readings that are rounded to steps q scatter by q
/// / sqrt(12) at least. Throws Error(bad_input) if fewer than 10 readings could tell it.
[[nodiscard]] ReadingScatter scatter_of(const PreparedRecording& recording,
                                        const RecordingParts& parts);
/// @param clipped whether a reading, before anything was taken out of it, stands at a limit of the
///                force cell: such readings do not scatter
[[nodiscard]] ReadingScatter scatter_of(const PreparedRecording& recording,
                                        const RecordingParts& parts,
                                        const Eigen::Array<bool, Eigen::Dynamic, 1>& clipped);

}  // namespace tpm::fit
