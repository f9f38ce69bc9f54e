#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/likelihood/parameter.hpp"

namespace tpm::fit {

class ExperimentResiduals;

/// Effect of correlated or rounded readings on one estimate of ordinary least squares.
struct NoiseOfEstimate {
  double variance_ratio = 0.0;  ///< its variance over that for independent noise of size 1; 0: none
  double degrees = 1.0;         ///< of freedom of Student's t
  /// Bound of its bias from rounded readings, in standard errors for independent noise of size 1.
  double bias = 0.0;
};

/// Noise of recordings whose neighbours are correlated, and what it does to the estimates of
/// ordinary least squares.
///
/// phi and the size s come from restricted maximum likelihood with the Jacobian J of the fit
/// (estimate_autoregression). Least squares stays unbiased; its covariance is
///
///     (J'J + P)^-1 (s^2 J'R(phi)J + Q) (J'J + P)^-1,
///
/// P and Q from priors, and, where the rests of a recording gave its zero and its drift, from the
/// correlation of the rest before contact with the readings behind it. An estimate that follows
/// fast changes suffers less from slow noise than a plateau does: each has its own variance and its
/// own degrees of freedom (Satterthwaite).
struct NoiseOfEstimates {
  double phi = 0.0;        ///< correlation of samples step_s apart
  double step_s = 0.0;     ///< median distance of samples
  double variance = 1.0;   ///< of one reading, in units of the declared one
  double inflation = 1.0;  ///< readings per independent reading, for their mean
  /// Factor of the variance for what is left of the correlation after an autoregression of first
  /// order (a law that does not describe the data, say); 1 if nothing is.
  double beyond = 1.0;
  std::vector<NoiseOfEstimate> of;  ///< of each parameter
  std::vector<std::size_t> free;    ///< parameters that are not at a bound
  Eigen::MatrixXd covariance;       ///< of those, in natural values
  bool correlated = false;          ///< else rounding, or noise of the drive, is all there is
  bool limited = false;             ///< by the resolution of the readings
  std::string summary;              ///< one sentence
};

/// Nothing if residuals are independent and not limited by rounding, if the configuration ignores
/// correlation, if there are no recordings, if they are met to what computing leaves of them
/// (computed_variance), or where residuals are no plain differences (a robust
/// loss, noise that is not normal or whose size is a parameter). Independent means: neither does
/// the Ljung-Box test reject at 1 % nor the restricted likelihood ratio of phi = 0.
///
/// Readings that are rounded to steps q hide the noise where it is smaller than half a step (by a
/// test at 5 %, for its size is estimated: else half of the fits whose noise is half a step are
/// called limited). The
/// errors of rounding are then no noise: each is at most half a step, and so an estimate is biased
/// by at most (q/2) sum |d estimate / d reading|, which widens its interval.
///
/// A drive that was rounded to coarse steps q (rounded_levels) has one error of variance q^2/12 for
/// all readings of a hold, which the law answers: its depth is off as a whole. The
/// covariance then has that of the changes of the estimates with such errors.
///
/// @param natural the minimum, SI
[[nodiscard]] std::optional<NoiseOfEstimates> noise_of_estimates(
    const ExperimentResiduals& function, std::span<const FitParameter> parameters,
    std::span<const double> natural);

}  // namespace tpm::fit
