#pragma once
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::fit {

/// The short answer of a budget: which stage loses most, each line in parts of the peak, what a
/// hand can tell, and every flag.
[[nodiscard]] ShortAnswer short_answer(const ErrorBudget& budget);

}  // namespace tpm::fit
