#pragma once
#include "tpm/paper/show/paper_report.hpp"
#include "tpm/show/document.hpp"

namespace tpm::paper {

/// The sections of the report on the paper, in its order. Each adds its blocks to the document;
/// every sentence with a verdict is made from the numbers of `report`.
void add_summary(Document& document, const PaperReport& report);
void add_data(Document& document, const PaperReport& report);
void add_tables(Document& document, const PaperReport& report);
void add_audit(Document& document, const PaperReport& report);
void add_fits(Document& document, const PaperReport& report);
void add_validation(Document& document, const PaperReport& report);
void add_paper_figures(Document& document, const PaperReport& report);
void add_validity(Document& document, const PaperReport& report);
void add_assumptions(Document& document, const PaperReport& report);

/// Numbers of comparisons with the printed data that are adequate, not adequate, undetermined.
[[nodiscard]] std::string validation_sentence(const PaperReport& report);

/// The errors of the section on validation beside the requirement.
[[nodiscard]] Figure validation_error_figure(const std::vector<PrintedComparison>& all,
                                             double requirement);

/// Title and caption of a figure of the report. Throws Error(environment) if there is none of that
/// id.
[[nodiscard]] Picture caption_of(const PaperReport& report, const std::string& figure_id);

}  // namespace tpm::paper
