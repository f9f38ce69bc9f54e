#pragma once
#include <span>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// Fits again with the hypothesis' parameters fixed, from the best fit and ten other starts, and
/// asks whether the rise of the deviance excludes it. Throws Error(numerical) if the model cannot
/// be evaluated there.
[[nodiscard]] HypothesisResult test_hypothesis(const ExperimentResiduals& function,
                                               const FitResult& fit,
                                               std::span<const FitParameter> parameters,
                                               const Hypothesis& hypothesis,
                                               const Threshold& threshold);

}  // namespace tpm::fit
