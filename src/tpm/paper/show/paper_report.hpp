#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tpm/fit/select/fit_variations.hpp"
#include "tpm/paper/claims/audit.hpp"
#include "tpm/paper/printed_comparison.hpp"
#include "tpm/paper/show/paper_figures.hpp"
#include "tpm/paper/tables.hpp"
#include "tpm/show/document.hpp"
#include "tpm/show/figure.hpp"
#include "tpmkit/curve.hpp"

namespace tpm::paper {

/// Everything the report on the paper says, computed: the same input gives the same content.
struct PaperReport {
  PaperFigureData figure_data;  ///< the data sets and both parameter sets
  TablesResult tables;          ///< as the paper computes them: a step
  TablesResult consistent;      ///< with the stated dashpot and a ramp
  AuditReport audit;
  FitStudy fits;
  double requirement = 0.1;  ///< R of the validation, as a share of the measured value
  std::vector<PrintedComparison> comparisons;
  std::vector<Figure> figures;
  std::map<std::string, double> seconds;  ///< wall time of each part, for the sidecar only
};

/// Recomputes the paper's tables, its claims, the fits to its data and Figures 6-10 from the files
/// of share_dir(). Throws Error(bad_input) if one of them is wrong.
/// @param requirement R of the validation, as a share of the measured value, above 0 and below 1
[[nodiscard]] PaperReport make_paper_report(double requirement = 0.1);

/// Conclusions, one verdict a sentence.
[[nodiscard]] std::vector<std::string> summary_sentences(const PaperReport& report);

/// The report as a document.
[[nodiscard]] Document paper_document(const PaperReport& report);

/// Writes report.html, report.md, tables.{md,csv,tex,json}, audit.json, fit_*.json,
/// validation.json, figures.json and figures/*.{svg,pdf} into `folder`, and report.run.json, the
/// only file that changes from run to run.
/// @param python from find_drawing_python()
void write_paper_report(const PaperReport& report, const std::filesystem::path& folder,
                        const std::string& python);

}  // namespace tpm::paper
