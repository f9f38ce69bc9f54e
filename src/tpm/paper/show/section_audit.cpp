// Declared in tpm/paper/show/sections.hpp.
// The section on the audit: each claim of the paper, recomputed.
#include <fmt/format.h>

#include <algorithm>

#include "tpm/base/lists.hpp"
#include "tpm/paper/show/sections.hpp"

namespace tpm::paper {
namespace {

Tone tone_of_finding(AuditVerdict verdict) {
  switch (verdict) {
    case AuditVerdict::holds:
    case AuditVerdict::holds_by_truncation:
      return Tone::good;
    case AuditVerdict::last_digit_off:
    case AuditVerdict::undetermined:
      return Tone::fair;
    case AuditVerdict::differs:
    case AuditVerdict::contradicted:
      break;
  }
  return Tone::bad;
}

/// Consequence of the finding and, where the digits betray it, the origin of the number.
std::string consequence(const Finding& finding) {
  std::string text = finding.consequence;
  if (!finding.causes.empty()) {
    if (!text.empty()) text += " ";
    text += fmt::format("It would follow from {}.", finding.causes.front().text);
  }
  return text;
}

/// "holds 20, holds by truncation 2, ..." with every verdict that occurs.
std::string counts(const AuditReport& audit) {
  std::vector<std::string> parts;
  for (const auto& [verdict, name] : kAuditVerdicts) {
    const int n = audit.count(verdict);
    if (n > 0) parts.push_back(fmt::format("{} {}", name, n));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// The printed number, or that of one printed equation.
std::string compared_words(const Finding& finding) {
  return finding.printed.empty() ? fmt::format("({})", finding.derived) : finding.printed;
}

/// The claims by topic, as the claims file orders them.
Table claims_table(const AuditReport& audit) {
  Table table{"",
              {{"where"},
               {"claim"},
               {"printed", true},
               {"recomputed", true},
               {"verdict"},
               {"what follows"}}};
  for (const std::string& topic : each_once(audit.findings, &Finding::topic)) {
    for (const Finding& f : audit.findings) {
      if (f.topic != topic) continue;
      table.rows.push_back({{f.where},
                            {f.claim},
                            {compared_words(f)},
                            {f.recomputed_words()},
                            {f.verdict_words(), tone_of_finding(f.verdict)},
                            {consequence(f)}});
    }
  }
  return table;
}

}  // namespace

void add_audit(Document& document, const PaperReport& report) {
  const AuditReport& audit = report.audit;
  document.heading(2, "Audit");
  document.paragraph(
      fmt::format("{} claims of the paper, each recomputed from its own equations and numbers: {}. "
                  "In parentheses: what one printed equation gives, or a bound, where no number is "
                  "printed.",
                  audit.findings.size(), counts(audit)));
  document.table(claims_table(audit));
}

}  // namespace tpm::paper
