#include "tpm/fit/prediction.hpp"

#include <fmt/format.h>

#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

void require_sizes(Eigen::Index predicted, const RowMatrix& sensitivity, std::size_t parameters,
                   Eigen::Index noise) {
  if (sensitivity.rows() == predicted &&
      sensitivity.cols() == static_cast<Eigen::Index>(parameters) &&
      (noise == 0 || noise == predicted)) {
    return;
  }
  throw bad_input("prediction bands",
                  fmt::format("{} predictions, {} x {} sensitivities, {} standard deviations",
                              predicted, sensitivity.rows(), sensitivity.cols(), noise),
                  fmt::format("one row per prediction and {} columns", parameters));
}

}  // namespace

Eigen::VectorXd prediction_standard_errors(const RowMatrix& sensitivity,
                                           std::span<const FitParameter> parameters,
                                           std::span<const double> natural,
                                           const Covariance& covariance) {
  if (!covariance.full_rank) return {};
  const Eigen::Index k = covariance.theta_sd.size();
  Eigen::MatrixXd scaled(sensitivity.rows(), k);
  for (Eigen::Index c = 0; c < k; ++c) {
    const std::size_t j = covariance.free[static_cast<std::size_t>(c)];
    const FitParameter& p = parameters[j];
    scaled.col(c) = sensitivity.col(static_cast<Eigen::Index>(j)) *
                    (p.natural_slope(p.theta(natural[j])) * covariance.theta_sd[c]);
  }
  return (scaled * covariance.correlation)
      .cwiseProduct(scaled)
      .rowwise()
      .sum()
      .cwiseMax(0.0)
      .cwiseSqrt();
}

PredictionBands prediction_bands(const Eigen::VectorXd& predicted, const RowMatrix& sensitivity,
                                 std::span<const FitParameter> parameters, const Minimum& minimum,
                                 const Covariance& covariance, const Threshold& threshold,
                                 const Eigen::VectorXd& noise_sd) {
  require_sizes(predicted.size(), sensitivity, parameters.size(), noise_sd.size());
  if (!covariance.full_rank) {
    throw bad_input("prediction bands", "the data do not determine all parameters",
                    "a covariance of full rank");
  }
  PredictionBands bands;
  bands.standard_error =
      prediction_standard_errors(sensitivity, parameters, minimum.natural, covariance);
  bands.multiplier = threshold.multiplier(minimum.deviance);
  bands.lower = predicted - bands.multiplier * bands.standard_error;
  bands.upper = predicted + bands.multiplier * bands.standard_error;
  if (noise_sd.size() == 0) return bands;
  const double factor = threshold.variance_factor(minimum.deviance);
  const Eigen::VectorXd reading =
      bands.multiplier *
      (bands.standard_error.cwiseAbs2() + factor * noise_sd.cwiseAbs2()).cwiseSqrt();
  bands.reading_lower = predicted - reading;
  bands.reading_upper = predicted + reading;
  return bands;
}

}  // namespace tpm::fit
