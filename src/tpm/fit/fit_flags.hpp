#pragma once
#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// By how many standard deviations of its prior the readings moved each parameter that has one, a
/// line for each. `flagged`: of priors that are stated, not measured, and of those moved by more
/// than three (a wrong law can do that); else of the others.
std::vector<std::string> prior_words(const FitResult& result, bool flagged);

/// Appends what a reader of a complete result must know: outliers, estimated noise, correlated
/// residuals, priors that the readings contradict, assumed rates, bands, robust losses, limits of
/// the paper's element.
void add_flags(FitResult& result, const ExperimentResiduals& function);

}  // namespace tpm::fit
