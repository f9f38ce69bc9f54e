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
  /// sqrt(tau^2 + s^2), s^2 the mean square of the recordings' own u: tau^2 is the difference of
  /// this square, which has n - 1 degrees of freedom, and s^2. It is no better known where it is 0.
  double with_own = 0.0;
  /// u of the law's own mean over them is tau times this, sqrt(sum w^2) / sum w with the numbers of
  /// fitted readings as the weights w.
  double of_mean = 0.0;

  [[nodiscard]] double tau() const { return deviations.norm(); }
  [[nodiscard]] int degrees() const { return recordings - 1; }  ///< of with_own^2
  /// The largest tau that 95 % do not exclude: with_own^2 (n - 1) over the quantile of 5 % of
  /// chi^2, less s^2.
  [[nodiscard]] double tau_at_most() const;
};

/// Random effects (random_effects()) of D / S, S the law's along each recording of its own
/// calibration; of each quantity that two or more of them have.
/// @param calibration compared with the law
/// @param readings fitted, of each
[[nodiscard]] std::vector<SpecimenSpread> specimen_spreads(
    std::span<const RecordingComparison> calibration, std::span<const int> readings);

}  // namespace tpm::fit
