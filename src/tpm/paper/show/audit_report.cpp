// Declared in tpm/paper/show/study_report.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tpm/base/printed_number.hpp"
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

/// "creep-probe +50 %"
std::string named_with_difference(const Finding& finding) {
  if (finding.verdict != AuditVerdict::differs || !finding.difference_percent) return finding.id;
  return fmt::format("{} {}", finding.id, percent_text(*finding.difference_percent));
}

/// The claims of a verdict, so many to a line as fit; of those that stand the number is enough.
std::vector<std::string> verdict_lines(const AuditReport& report,
                                       const Word<AuditVerdict>& verdict) {
  constexpr std::size_t kNames = 27;
  std::string names;
  for (const Finding& finding : report.findings) {
    if (finding.verdict != verdict.meaning || finding.stands()) continue;
    names += (names.empty() ? "" : ", ") + named_with_difference(finding);
  }
  std::string all = fmt::format("{:<21}{:>4}  {}", verdict.text, report.count(verdict.meaning),
                                wrapped(names, kWidth + 16, kNames, kNames));
  all.erase(all.find_last_not_of(' ') + 1);
  return separate_lines(all);
}

/// Findings with another number, the largest difference first.
std::vector<const Finding*> furthest_off(const AuditReport& report) {
  std::vector<const Finding*> found;
  for (const Finding& finding : report.findings) {
    if (finding.verdict == AuditVerdict::differs && finding.difference_percent) {
      found.push_back(&finding);
    }
  }
  std::ranges::stable_sort(found, std::greater<>(), [](const Finding* finding) {
    return std::abs(*finding->difference_percent);
  });
  return found;
}

}  // namespace

std::string audit_text(const AuditReport& report) {
  std::string out = report.title + "\n\n";
  for (const Finding& finding : report.findings) out += finding_text(finding);
  return out + summary_text(report);
}

ShortAnswer short_answer(const AuditReport& report) {
  constexpr std::size_t kFurthest = 5;
  ShortAnswer answer;
  answer.conclusion = {report.title, summary_text(report)};
  answer.head = {"verdict             claims  which do not stand"};
  for (const auto& verdict : kAuditVerdicts) {
    if (report.count(verdict.meaning) == 0) continue;
    for (std::string& line : verdict_lines(report, verdict)) answer.rows.push_back(std::move(line));
  }
  answer.rest = [count = answer.rows.size()](std::size_t from) {
    return fmt::format("... and {} more lines of claims: --verbose", count - from);
  };
  const std::vector<const Finding*> furthest = furthest_off(report);
  for (std::size_t i = 0; i < std::min(furthest.size(), kFurthest); ++i) {
    const Finding& f = *furthest[i];
    answer.limits.push_back(fmt::format(
        "{} {}: {} {}, recomputed {} ({})", i == 0 ? "furthest off:" : "             ", f.id,
        f.printed.empty() ? "derived" : "printed", f.compared(), f.recomputed_words(), f.where));
  }
  return answer;
}

}  // namespace tpm::paper
