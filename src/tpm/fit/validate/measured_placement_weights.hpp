#pragma once
#include <Eigen/Core>
#include <optional>

#include "tpm/fit/recording/placement.hpp"

namespace tpm::fit {

/// Derivatives of a measured zero (read_rests) by the recording's readings: their mean before
/// contact. None where readings after the test take part.
[[nodiscard]] std::optional<Eigen::VectorXd> zero_by_reading(const Recording& recording,
                                                             const RestReadings& rests);

/// Derivatives of a measured onset (find_onset) by the recording's readings, to first order: least
/// squares of A x^m + B x^(m+1), x = drive - contact, within the part of the ramp that tells it,
/// and through the zero. None for an onset that was stated, not extrapolated.
/// @param exponent m
[[nodiscard]] std::optional<Eigen::VectorXd> onset_by_reading(const PreparedRecording& recording,
                                                              const Onset& onset, double exponent,
                                                              double zero,
                                                              const Eigen::VectorXd& zero_weights);

}  // namespace tpm::fit
