#pragma once
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/boundary/boundary_study.hpp"
#include "tpm/show/figure.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::haptics {

/// Report of `tpm hil stability`; keys are described in docs/haptics.md.
[[nodiscard]] Json boundary_json(const BoundaryStudy& study);
[[nodiscard]] std::string boundary_text(const BoundaryStudy& study);
/// How far theory holds, the largest stiffness at 1 kHz for each delay, and what limits it.
[[nodiscard]] ShortAnswer short_answer(const BoundaryStudy& study);
/// The boundaries of passivity and of stability, and the three rules.
[[nodiscard]] std::vector<Figure> boundary_figures(const BoundaryStudy& study);

}  // namespace tpm::haptics
