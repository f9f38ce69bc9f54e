#pragma once
#include <optional>

#include "tpm/fit/fit.hpp"
#include "tpmkit/curve.hpp"

namespace tpm::fit {

/// Readings of a relaxation modulus that stand at the least one, below which the instrument does
/// not read.
struct FloorOfReadings {
  std::size_t count = 0;   ///< of equal readings
  double value = 0.0;      ///< of them, SI
  double last_s = 0.0;     ///< last reading before the first of them
  std::size_t behind = 0;  ///< readings from the first of them on
};

/// Finds at least 4 equal least readings, more than 3 times as many as are equal elsewhere, where
/// the others scatter about the fit by more than they were rounded.
[[nodiscard]] std::optional<FloorOfReadings> find_floor(const Recording& step,
                                                        const FitResult& fit);

/// Noise a + b |reading| of an instrument whose readings stand at a floor above 0: a is the floor,
/// b the robust share of the residuals. Below a floor an instrument does not trust its readings,
/// and the few that lie little above it would else count as if they were as good as the large ones.
/// @param fit without the readings at the floor
/// @return a / b, SI; none if the noise is not taken to be a share of a reading
[[nodiscard]] std::optional<double> floor_as_scatter(const FitResult& fit,
                                                     const FloorOfReadings& floor);

/// Doubts the lasting stiffness of a material function (ParameterResult::not_separable) whose
/// readings are all above 0, where
/// - it is below 3 times the scatter that a reading of 0 may have (most_scatter_of_small): an
///   instrument that reads no negative values has a mean of 0.8 of it, and looks the same; or
/// - it is below half of the least stiffness that was read: no reading shows the plateau.
///   Not where the relaxation times are stated: then no slower branch is possible.
/// The configuration of the fit says it, too.
/// @return true if it is doubted
bool doubt_small_plateau(FitResult& fit, bool times_stated);

/// Where the lasting stiffness is doubted, so is each parameter that has another value without one.
/// @param fluid fit of the same law without it
void doubt_what_depends_on_plateau(FitResult& fit, const FitResult& fluid);

}  // namespace tpm::fit
