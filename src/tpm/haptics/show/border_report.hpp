#pragma once
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/border/border_study.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::haptics {

/// What `tpm hil stability` shows; keys are described in docs/haptics.md.
[[nodiscard]] Json border_json(const BorderStudy& study);
[[nodiscard]] std::string border_text(const BorderStudy& study);
/// The borders of passivity and of stability, and the three rules.
[[nodiscard]] std::vector<Figure> border_figures(const BorderStudy& study);

}  // namespace tpm::haptics
