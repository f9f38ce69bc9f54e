#pragma once
#include <string>
#include <vector>

#include "tpm/fit/design/design.hpp"

namespace tpm::fit {

/// "0.28-0.33 s", "below 3 s", "any value": the expected interval in the parameter's own unit.
[[nodiscard]] std::string interval_words(const FitParameter& parameter,
                                         const ExpectedParameter& expected);

/// One sentence for each parameter under the best candidate: its interval, whether it would be
/// identified, what limits it, and which single change of the protocol would matter most.
[[nodiscard]] std::vector<std::string> design_words(const DesignResult& result);

/// "relative standard error of eta1"
[[nodiscard]] std::string criterion_words(const DesignProblem& problem);

}  // namespace tpm::fit
