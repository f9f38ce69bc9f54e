#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>

namespace tpm::fit {

class ExperimentResiduals;
struct Experiment;

/// Zero and drift of a recording that its rests gave, as priors. The noise of the rest before
/// contact goes on in the readings that are fitted, so that the errors of both priors are
/// correlated with it.
struct MeasuredAtRest {
  double last_s = 0.0;    ///< time of the last reading of the rest
  double origin_s = 0.0;  ///< where zero and drift are uncorrelated
  double sigma = 1.0;     ///< declared noise of a reading
  double zero_sd = 0.0, drift_sd = 0.0;
  std::size_t zero_prior = 0, drift_prior = 0;  ///< places among the priors of the configuration

  /// Of the errors of zero and drift with the noise of the last reading, in declared standard
  /// deviations. Estimates of generalised least squares, of covariance D, have
  ///
  ///     Cov(errors, e(last)) = D l,   l = (1, last - origin).
  ///
  /// The noise at a later time t, an autoregression of first order, has phi^((t - last)/step)
  /// times that: it remembers nothing but the last reading. The rest after withdrawal is left out,
  /// which lies further away. Stated standard deviations are wider than those of D: l'Dl is at
  /// most the variance of a reading.
  /// @param variance of a reading, in units of the declared one
  [[nodiscard]] Eigen::Vector2d covariance_with_last(double variance) const;
};

/// Nothing where the rests of a recording do not tell zero and drift, or none lies before contact.
/// @param step_s of samples: the rest ends one before the first reading that is fitted
[[nodiscard]] std::optional<MeasuredAtRest> measured_at_rest(const ExperimentResiduals& function,
                                                             const Experiment& experiment,
                                                             double step_s);

}  // namespace tpm::fit
