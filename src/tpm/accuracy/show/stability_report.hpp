#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/accuracy/stability/study.hpp"
#include "tpm/show/document.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::accuracy {

/// The maps of each rule, two to a figure, with the limit of theory drawn in.
[[nodiscard]] std::vector<Figure> stability_figures(const StabilityStudy& study);

/// Limits, limiting cases and servo rates, and of each map how often each class was found.
[[nodiscard]] Json to_json(const StabilityStudy& study);

/// The sentences that matter most: limits against theory, limiting cases that came out otherwise,
/// what holds at 1 kHz.
[[nodiscard]] std::vector<std::string> stability_sentences(const StabilityStudy& study);

/// Writes report.md, report.html, stability.json, limits.csv, limiting_cases.csv, servo.csv,
/// map_ID.csv for each map, figures.json and figures/*.{svg,pdf} into `folder`, and
/// report.run.json, the only file that changes from run to run.
/// @param python from find_drawing_python()
/// @param seconds wall time of the study
void write_stability(const StabilityStudy& study, const std::filesystem::path& folder,
                     const std::string& python, double seconds);

}  // namespace tpm::accuracy
