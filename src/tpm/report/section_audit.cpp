// The section on the audit: each claim of the paper, recomputed.
#include <fmt/format.h>

#include "tpm/core/text.hpp"
#include "tpm/report/sections.hpp"

namespace tpm {
namespace {

Tone tone_of(AuditVerdict verdict) {
  switch (verdict) {
    case AuditVerdict::holds:
    case AuditVerdict::holds_by_truncation:
      return Tone::good;
    case AuditVerdict::last_digit_off:
    case AuditVerdict::cannot_be_told:
      return Tone::fair;
    case AuditVerdict::differs:
    case AuditVerdict::contradicted:
      break;
  }
  return Tone::bad;
}

std::string with_unit(const std::optional<AuditQuantity>& quantity) {
  if (!quantity) return "-";
  const std::string number = significant(quantity->value, 4);
  return quantity->unit.symbol.empty() ? number : number + " " + quantity->unit.symbol;
}

/// What follows from the finding and, where the digits betray it, how the number came about.
std::string consequence(const Finding& finding) {
  std::string text = finding.consequence;
  if (!finding.causes.empty()) {
    if (!text.empty()) text += " ";
    text += fmt::format("It would follow from {}.", finding.causes.front().text);
  }
  return text;
}

}  // namespace

void add_audit(Document& document, const PaperReport& report) {
  const AuditReport& audit = report.audit;
  document.heading(2, "Audit");
  document.paragraph(fmt::format(
      "{} claims of the paper, each recomputed from its own equations and numbers. {} stand ({} of "
      "them with digits cut off instead of rounded), {} are off in the last digit, {} differ, {} "
      "are contradicted, {} cannot be told.",
      audit.findings.size(),
      audit.count(AuditVerdict::holds) + audit.count(AuditVerdict::holds_by_truncation),
      audit.count(AuditVerdict::holds_by_truncation), audit.count(AuditVerdict::last_digit_off),
      audit.count(AuditVerdict::differs), audit.count(AuditVerdict::contradicted),
      audit.count(AuditVerdict::cannot_be_told)));
  Table table{"",
              {{"where"},
               {"claim"},
               {"printed", true},
               {"recomputed", true},
               {"verdict"},
               {"what follows"}},
              {}};
  for (const Finding& f : audit.findings) {
    table.rows.push_back({{f.where},
                          {f.claim},
                          {f.printed},
                          {with_unit(f.recomputed)},
                          {f.verdict_words(), tone_of(f.verdict)},
                          {consequence(f)}});
  }
  document.table(std::move(table));
}

}  // namespace tpm
