// Declared in tpm/paper/show/sections.hpp.
// The first section, and the paper's figures: sentences made from the numbers.
#include <fmt/format.h>

#include <cmath>

#include "tpm/base/lists.hpp"
#include "tpm/base/printed_number.hpp"
#include "tpm/paper/show/sections.hpp"
#include "tpmkit/error.hpp"

namespace tpm::paper {
namespace {

Cell tables_sentence(const TablesResult& tables) {
  const CellCounts& c = tables.summary.force_from_printed_lambda1;
  return {
      fmt::format("Tables 1 to 4: {} of {} printed forces follow from the printed λ₁, {} of them "
                  "only by cutting digits off. Off in the last digit: {}; different: {}.",
                  c.explained(), c.cells, c.by_truncation, c.last_digit_off, c.differ),
      c.explained() == c.cells ? Tone::good : Tone::fair};
}

Cell audit_sentence(const AuditReport& audit) {
  int stand = 0;
  for (const Finding& f : audit.findings) stand += f.stands() ? 1 : 0;
  return {fmt::format(
              "Audit: of {} claims {} stand, {} differ from their recomputation, {} are "
              "contradicted by the paper's own equations or numbers; off in the last digit: "
              "{}; undetermined: {}.",
              audit.findings.size(), stand, audit.count(AuditVerdict::differs),
              audit.count(AuditVerdict::contradicted), audit.count(AuditVerdict::last_digit_off),
              audit.count(AuditVerdict::undetermined)),
          audit.count(AuditVerdict::contradicted) > 0 ? Tone::bad : Tone::good};
}

Cell held_out_sentence(const FitStudy& study) {
  int predicted = 0;
  int within = 0;
  double worst = 0.0;
  std::string worst_label;
  for (const HeldOutFit& h : study.held_out) {
    for (const FittedDatum& d : h.result.data) {
      if (!d.datum.held_out || !d.datum.value) continue;
      ++predicted;
      within += std::abs(d.standardised) <= 2.0 ? 1 : 0;
      const double percent = 100.0 * (d.predicted - *d.datum.value) / *d.datum.value;
      if (std::abs(percent) <= std::abs(worst)) continue;
      worst = percent;
      worst_label = d.datum.label;
    }
  }
  return {fmt::format("Held out, {} of {} readings are predicted within two assumed standard "
                      "deviations; the worst is {} ({}).",
                      within, predicted, worst_label, percent_text(worst, 0)),
          within == predicted ? Tone::good : Tone::fair};
}

std::vector<Cell> verdicts(const PaperReport& report) {
  std::vector<Cell> items{
      tables_sentence(report.tables),
      audit_sentence(report.audit),
      {fmt::format("The stated η₁ = {:.4g} Pa s gives a relaxation time of {:.3g} ms: no force "
                   "relaxes over 30 s, and no speed of 1 to 4 mm/s can matter.",
                   report.figure_data.paper.eta1_Pa_s,
                   report.figure_data.paper.relaxation_time_s() * 1e3),
       Tone::bad}};
  for (const ParameterResult& p : report.fits.reference.parameters) {
    items.push_back({"Fit: " + p.summary});
  }
  for (const HypothesisResult& h : report.fits.reference.hypotheses) {
    items.push_back({"Fit: " + h.summary, h.excluded ? Tone::bad : Tone::plain});
  }
  items.push_back(held_out_sentence(report.fits));
  items.push_back({validation_sentence(report), Tone::fair});
  return items;
}

}  // namespace

std::vector<std::string> summary_sentences(const PaperReport& report) {
  return mapped<std::string>(verdicts(report), &Cell::text);
}

Picture caption_of(const PaperReport& report, const std::string& figure_id) {
  for (const Figure& figure : report.figures) {
    if (figure.id == figure_id) return {figure.id, figure.title, figure.caption};
  }
  throw Error(ExitCode::environment, "report", fmt::format("has no figure '{}'", figure_id));
}

void add_summary(Document& document, const PaperReport& report) {
  document.heading(2, "Summary");
  document.bullets(verdicts(report));
}

void add_paper_figures(Document& document, const PaperReport& report) {
  document.heading(2, "Figures 6 to 10 and the spectrum");
  document.paragraph(
      "Redrawn as model against data. Lines are computed; filled marks and bars are printed or "
      "measured; open, hatched and dashed ones carry an assumption, which the legend names. The "
      "paper's own curves are not available and are not imitated.");
  for (const Figure& figure : report.figures) {
    if (figure.id.starts_with("figure_")) document.picture(caption_of(report, figure.id));
  }
}

}  // namespace tpm::paper
