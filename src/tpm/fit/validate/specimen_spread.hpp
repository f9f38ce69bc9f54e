#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "tpm/fit/validate/functional.hpp"

namespace tpm::fit {

struct RecordingComparison;

/// Spread of one quantity between the recordings of a calibration, each of another specimen: what a
/// new specimen of their population adds to u_input, as a share of S.
struct SpecimenSpread {
  QuantityOfInterest quantity;
  bool creep = false;  ///< of recordings under an imposed load
  int recordings = 0;  ///< two or more
  /// D / S of each recording less their mean, scaled to the norm tau: two quantities are correlated
  /// as their rows are.
  Eigen::RowVectorXd deviations;
  /// Effective, of tau^2: (n - 1) (tau^2 / (tau^2 + s^2))^2, s^2 the mean square of the recordings'
  /// own u, because tau^2 is a difference.
  double degrees = 0.0;
  /// u of the law's own mean over them is tau times this, sqrt(sum w^2) / sum w with the numbers of
  /// fitted readings as the weights w.
  double of_mean = 0.0;

  [[nodiscard]] double tau() const { return deviations.norm(); }
};

/// Random effects (random_effects()) of D / S, S the law's along each recording of its own
/// calibration; of each quantity that two or more of them have.
/// @param calibration compared with the law
/// @param readings fitted, of each
[[nodiscard]] std::vector<SpecimenSpread> specimen_spreads(
    std::span<const RecordingComparison> calibration, std::span<const int> readings);

}  // namespace tpm::fit
