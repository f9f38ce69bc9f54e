#pragma once
#include <Eigen/Core>
#include <span>

#include "tpm/fit/uncertainty.hpp"

namespace tpm::fit {

/// Standard error of each prediction from the parameters' covariance (delta method); empty if the
/// covariance is not of full rank. Parameters at a bound add nothing.
/// @param sensitivity d prediction / d natural, n x parameter count, SI
/// @param natural the minimum's parameter values, SI
[[nodiscard]] Eigen::VectorXd prediction_standard_errors(const RowMatrix& sensitivity,
                                                         std::span<const FitParameter> parameters,
                                                         std::span<const double> natural,
                                                         const Covariance& covariance);

/// Symmetric limits about each prediction, SI.
struct PredictionBands {
  Eigen::VectorXd standard_error;                ///< of the curve
  double multiplier = 0.0;                       ///< of the standard error, for the curve
  Eigen::VectorXd lower, upper;                  ///< confidence: where the curve is
  Eigen::VectorXd reading_lower, reading_upper;  ///< prediction: where one new reading falls
};

/// Linearised bands, each at its point alone. The multiplier of the standard error is Student's t
/// (with the residual degrees of freedom; normal if the noise scale is known; Seber & Wild,
/// Nonlinear Regression (1989), 5.1). A reading has the variance standard_error^2 + variance factor
/// sigma^2; the noise is taken as normal.
/// @param predicted n predictions, SI
/// @param noise_sd declared standard deviation of a reading at each point, SI, n values; or empty:
///        the bands for readings then stay empty
/// Throws Error(bad_input) if the covariance is not of full rank or sizes do not agree.
[[nodiscard]] PredictionBands prediction_bands(const Eigen::VectorXd& predicted,
                                               const RowMatrix& sensitivity,
                                               std::span<const FitParameter> parameters,
                                               const Minimum& minimum, const Covariance& covariance,
                                               const Threshold& threshold,
                                               const Eigen::VectorXd& noise_sd);

}  // namespace tpm::fit
