// Declared in tpm/paper/show/study_report.hpp.
#include <fmt/format.h>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/text.hpp"
#include "tpm/paper/show/study_report.hpp"

namespace tpm::paper {
namespace {

constexpr std::size_t kWidth = 100;
constexpr std::size_t kLabel = 13;

std::string quantity_with_unit(const AuditQuantity& quantity, int digits) {
  return with_unit(significant(quantity.value, digits), quantity.unit);
}

std::string entry(std::string_view label, std::string_view text) {
  if (text.empty()) return {};
  return fmt::format("    {:<{}}{}\n", label, kLabel - 4, wrapped(text, kWidth, kLabel, kLabel));
}

std::string inputs_text(const Finding& finding) {
  return listed(finding.inputs, [](const AuditInput& input) {
    return fmt::format("{} = {}{}", input.name,
                       input.printed.empty() ? quantity_with_unit(input.value, 4) : input.printed,
                       input.provenance == "assumed" ? " (assumed)" : "");
  });
}

/// Cells that follow need no line of their own.
std::string details_text(const Finding& finding) {
  std::string out;
  for (const AuditDetail& detail : finding.details) {
    if (detail.exact && finding.details.size() > 4) continue;
    out += fmt::format("    {:<{}}{}: {} against {}, {}\n", "", kLabel - 4, detail.what,
                       detail.printed, quantity_with_unit(detail.recomputed, 4), detail.verdict);
  }
  return out;
}

std::string finding_text(const Finding& finding) {
  const bool open = finding.verdict == AuditVerdict::undetermined;
  const std::string_view mark = finding.stands() ? "ok" : open ? "??" : "!!";
  std::string out = fmt::format("{}  {}  [{}]\n", mark, finding.id, finding.verdict_words());
  // "paper" first: the reader knows the paper, not our names.
  out += entry("paper", fmt::format("{}: {}", finding.where, finding.claim));
  out += entry(finding.printed.empty() ? "derived" : "printed",
               fmt::format("{}   recomputed {}", finding.compared(), finding.recomputed_words()));
  out += entry("by", finding.expression);
  out += entry("with", inputs_text(finding));
  for (const AuditCause& cause : finding.causes) {
    out += entry("given by", fmt::format("{}  ({})", cause.text, significant(cause.recomputed, 5)));
  }
  out += details_text(finding);
  out += entry("so", finding.consequence);
  return out + "\n";
}

std::string summary_text(const AuditReport& report) {
  return fmt::format("{} claims: {}.\n", report.findings.size(),
                     listed(kAuditVerdicts, [&](const auto& verdict) {
                       return fmt::format("{} {}", report.count(verdict.meaning), verdict.text);
                     }));
}

}  // namespace

std::string audit_text(const AuditReport& report, bool all) {
  std::string out = report.title + "\n\n";
  std::size_t left_out = 0;
  for (const Finding& finding : report.findings) {
    if (finding.stands() && !all) {
      ++left_out;
      continue;
    }
    out += finding_text(finding);
  }
  if (left_out > 0)
    out += fmt::format("{} claims that hold are not shown (--verbose).\n", left_out);
  return out + summary_text(report);
}

}  // namespace tpm::paper
