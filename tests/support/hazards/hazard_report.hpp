#pragma once
#include <string>

#include "hazards/clock_hazard_study.hpp"
#include "hazards/hazard_study.hpp"

namespace tpm::haptics {

/// Tables in Markdown, of reports/haptics/report.md, described in docs/safety.md.
[[nodiscard]] std::string hazard_text(const HazardStudy& study);
[[nodiscard]] std::string clock_hazard_text(const ClockHazardStudy& study);

}  // namespace tpm::haptics
