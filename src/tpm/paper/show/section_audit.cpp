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
    case AuditVerdict::cannot_be_told:
      return Tone::fair;
    case AuditVerdict::differs:
    case AuditVerdict::contradicted:
      break;
  }
  return Tone::bad;
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

/// "holds 20, holds by truncation 2, ..." with every verdict that occurs.
std::string counts(const AuditReport& audit) {
  std::vector<std::string> parts;
  for (const auto& [verdict, name] : kAuditVerdicts) {
    const int n = audit.count(verdict);
    if (n > 0) parts.push_back(fmt::format("{} {}", name, n));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// "2 Eq. 18" -> "Claims: Eq. 18"; the number only orders the claims file.
std::string heading_of(const std::string& topic) {
  return "Claims: " + topic.substr(std::min(topic.find_first_not_of("0123456789 "), topic.size()));
}

Table empty_table() {
  return {"",
          {{"where"},
           {"claim"},
           {"printed", true},
           {"recomputed", true},
           {"verdict"},
           {"what follows"}}};
}

std::vector<Cell> row(const Finding& f) {
  return {{f.where},
          {f.claim},
          {f.printed},
          {f.recomputed_words()},
          {f.verdict_words(), tone_of_finding(f.verdict)},
          {consequence(f)}};
}

}  // namespace

void add_audit(Document& document, const PaperReport& report) {
  const AuditReport& audit = report.audit;
  document.heading(2, "Audit");
  document.paragraph(
      fmt::format("{} claims of the paper, each recomputed from its own equations and numbers: {}.",
                  audit.findings.size(), counts(audit)));
  for (const std::string& topic : each_once(audit.findings, &Finding::topic)) {
    Table table = empty_table();
    for (const Finding& f : audit.findings) {
      if (f.topic == topic) table.rows.push_back(row(f));
    }
    document.heading(3, heading_of(topic));
    document.table(std::move(table));
  }
}

}  // namespace tpm::paper
