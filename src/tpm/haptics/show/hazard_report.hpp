#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/hazards/clock_hazard_study.hpp"
#include "tpm/haptics/hazards/hazard_study.hpp"

namespace tpm::haptics {

/// What `tpm hil hazards` shows; keys are described in docs/haptics.md. The text is a table in
/// Markdown.
[[nodiscard]] Json hazard_json(const HazardStudy& study);
[[nodiscard]] std::string hazard_text(const HazardStudy& study);
[[nodiscard]] Json clock_hazard_json(const ClockHazardStudy& study);
[[nodiscard]] std::string clock_hazard_text(const ClockHazardStudy& study);

}  // namespace tpm::haptics
