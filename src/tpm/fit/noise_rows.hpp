#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "tpm/fit/measured_at_rest.hpp"

namespace tpm::fit {

class ExperimentResiduals;

/// Rows of one recording among those of all residuals.
struct RecordingRows {
  Eigen::Index first = 0, count = 0;
};

/// The residuals of a fit as noise of readings sees them: those of values, then those of priors.
struct NoiseRows {
  std::vector<double> time_s;  ///< recordings and separate readings far apart
  Eigen::VectorXd residual;
  Eigen::MatrixXd jacobian;          ///< by the free parameters, natural
  Eigen::VectorXd half_step;         ///< of rounding, in units of the declared noise; of values
  std::vector<double> prior_weight;  ///< of each prior's residual
  std::vector<RecordingRows> recordings;
  std::vector<std::optional<MeasuredAtRest>> at_rest;  ///< of each recording
  double step_s = 0.0;

  [[nodiscard]] Eigen::Index priors() const { return std::ssize(prior_weight); }
  [[nodiscard]] Eigen::Index values() const { return residual.size() - priors(); }
};

/// The rows at given parameters. None if the residuals cannot be evaluated, or if readings of a
/// recording do not follow each other in time.
/// @param free columns of the Jacobian: parameters that are not at a bound
/// @param natural of all parameters, SI
[[nodiscard]] std::optional<NoiseRows> noise_rows(const ExperimentResiduals& function,
                                                  std::span<const std::size_t> free,
                                                  std::span<const double> natural);

}  // namespace tpm::fit
