#pragma once
#include <span>

namespace tpm::fit {

class ExperimentResiduals;

/// Step between neighbouring levels of readings that were rounded to a grid; 0 if there is none.
[[nodiscard]] double quantum_of(std::span<const double> readings);

/// Below this variance, in squares of half a step, the noise of rounded readings is smaller than
/// half a step by more than chance (5 %) explains. Rounding itself is a part of the variance.
/// @param degrees independent readings behind the variance
[[nodiscard]] double hidden_noise_variance(double degrees);

/// Relative error of a reading by computing: responses and minima are exact to about 1e-10, and no
/// instrument reads nine digits.
constexpr double kComputedShare = 1e-9;

/// Mean square of that error of the values, in units of the declared noise: the least variance that
/// an estimate of the noise can mean.
[[nodiscard]] double computed_variance(const ExperimentResiduals& function);

}  // namespace tpm::fit
