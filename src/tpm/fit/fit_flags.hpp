#pragma once
#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// Appends what a reader of a complete result must know: outliers, estimated noise, correlated
/// residuals, assumed rates, bands, robust losses, limits of the paper's element.
void add_flags(FitResult& result, const ExperimentResiduals& function);

}  // namespace tpm::fit
