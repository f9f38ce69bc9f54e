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

/// The claims of a topic, with columns for numbers that stand in print and for those that follow
/// from it, as far as there are any.
Table table_of_topic(const AuditReport& audit, const std::string& topic) {
  bool printed = false, derived = false;
  for (const Finding& f : audit.findings) {
    if (f.topic == topic) (f.printed.empty() ? derived : printed) = true;
  }
  Table table{"", {{"where"}, {"claim"}}};
  if (printed) table.columns.push_back({"printed", true});
  if (derived) table.columns.push_back({"derived from print", true});
  table.columns.insert(table.columns.end(), {{"recomputed", true}, {"verdict"}, {"what follows"}});
  for (const Finding& f : audit.findings) {
    if (f.topic != topic) continue;
    std::vector<Cell> row{{f.where}, {f.claim}};
    if (printed) row.push_back({f.printed.empty() ? "-" : f.printed});
    if (derived) row.push_back({f.derived.empty() ? "-" : f.derived});
    row.insert(row.end(), {{f.recomputed_words()},
                           {f.verdict_words(), tone_of_finding(f.verdict)},
                           {consequence(f)}});
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

void add_audit(Document& document, const PaperReport& report) {
  const AuditReport& audit = report.audit;
  document.heading(2, "Audit");
  document.paragraph(
      fmt::format("{} claims of the paper, each recomputed from its own equations and numbers: {}. "
                  "'Derived from print' is what one printed equation gives, or a bound, where no "
                  "number is printed; 'recomputed' is what the other side gives.",
                  audit.findings.size(), counts(audit)));
  for (const std::string& topic : each_once(audit.findings, &Finding::topic)) {
    document.heading(3, heading_of(topic));
    document.table(table_of_topic(audit, topic));
  }
}

}  // namespace tpm::paper
