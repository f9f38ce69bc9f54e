#pragma once
#include <vector>

#include "tpm/fit/design/design.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Expected relative standard error of each parameter (one panel each): against the hold with a
/// curve per ramp rate, and against the rate with a curve per hold. Depth (or load), sampling and
/// repeats are those of the best candidate. More than three parameters are spread over several
/// figures (design_hold, design_hold_2). A figure whose axis has fewer than two values is left
/// out; so are candidates that leave a parameter unknown.
[[nodiscard]] std::vector<Figure> design_figures(const DesignResult& result);

}  // namespace tpm::fit
