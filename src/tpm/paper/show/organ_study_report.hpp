#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/paper/organ_study.hpp"
#include "tpm/show/document.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::paper {

/// Static force over depth, relaxation at every depth, the rates at one depth, and creep under
/// every load, each for all tissues and with the data.
[[nodiscard]] std::vector<Figure> organ_study_figures(const OrganStudy& study);

/// Cost of "we ignore the displacement of the spheres A and C" at each material, a sentence for
/// each other tissue.
[[nodiscard]] std::vector<std::string> cost_sentences(const OrganStudy& study);

/// One line per reading, SI units in the column names.
[[nodiscard]] std::string readings_csv(const OrganStudy& study);
/// One line per estimated parameter of every fit.
[[nodiscard]] std::string fits_csv(const OrganStudy& study);
/// One line per point of every curve.
[[nodiscard]] std::string curves_csv(const OrganStudy& study);

/// Writes report.md, report.html, experiments.json, readings.csv, fits.csv, curves.csv,
/// figures.json and figures/*.{svg,pdf} into `folder`, and report.run.json, the only file that
/// changes from run to run.
/// @param python from find_drawing_python()
/// @param seconds wall time of the study
void write_organ_study(const OrganStudy& study, const std::filesystem::path& folder,
                       const std::string& python, double seconds);

}  // namespace tpm::paper
