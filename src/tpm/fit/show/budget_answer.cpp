#include "tpm/fit/show/budget_answer.hpp"

#include <fmt/format.h>

#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/plan/perception.hpp"

namespace tpm::fit {
namespace {

std::string share_of_peak(double part) {
  return significant(100.0 * part, 3) + " %";
}

std::string budget_row(const std::string& name, const std::string& largest,
                       const std::string& rms) {
  return fmt::format("{:<40} {:>12} {:>12}", name, largest, rms);
}

}  // namespace

ShortAnswer short_answer(const ErrorBudget& b) {
  ShortAnswer answer;
  answer.conclusion = remark_texts(b.sentences);
  answer.conclusion.insert(
      answer.conclusion.begin(),
      fmt::format("{}: peak {}", b.title, sized_text(Dimension::force, b.peak_N, 4)));
  answer.head = {budget_row("changed by, in parts of the peak", "largest", "rms")};
  for (const BudgetLine& line : b.lines) {
    answer.rows.push_back(budget_row(fmt::format("{} ({})", line.name, budget_kind_name(line.kind)),
                                     share_of_peak(line.largest), share_of_peak(line.rms)) +
                          (line.largest < kLeastLine ? "  (below 0.1 %)" : ""));
  }
  answer.limits = {budget_row("largest sum of all lines", share_of_peak(b.total), "")};
  if (b.random) {
    answer.limits.push_back(
        budget_row(fmt::format("parameters, {} % band", significant(100.0 * b.random->level, 3)),
                   share_of_peak(b.random->largest), ""));
  }
  if (b.instrument) {
    answer.limits.push_back(budget_row(fmt::format("instrument {}, {} %", b.instrument->id,
                                                   significant(100.0 * b.instrument->level, 3)),
                                       share_of_peak(b.instrument->largest), ""));
  }
  answer.limits.push_back(budget_row(b.instrument ? "all in quadrature" : "both in quadrature",
                                     share_of_peak(b.combined), ""));
  answer.limits.push_back(
      fmt::format("just noticeable differences: {} of a force, {} of a stiffness that is touched, "
                  "{} of one felt through a tool",
                  share_of_peak(kForceJnd), share_of_peak(plan::kStiffnessTouched),
                  share_of_peak(kStiffnessThroughTool)));
  for (std::string& line : answer.limits) line.erase(line.find_last_not_of(' ') + 1);
  answer.warnings = remark_texts(b.remarks);
  return answer;
}

}  // namespace tpm::fit
