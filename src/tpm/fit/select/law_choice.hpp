#pragma once
#include "tpm/fit/fit.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// Keeps the conditions of a choice among laws in the configuration of the chosen fit, once its
/// summary is complete: a fit of the written configuration says them again.
void keep_choice(Selection& s);

/// Says again what was known when the law of the configuration was chosen. If the law, the number
/// of fitted samples or the readings (samples_sha256) differ since, a remark says which, and
/// nothing is repeated.
void repeat_choice(FitResult& fit);

}  // namespace tpm::fit
