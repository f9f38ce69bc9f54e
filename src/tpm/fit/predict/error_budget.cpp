#include "tpm/fit/predict/error_budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/text.hpp"
#include "tpm/plan/perception.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {
namespace {

constexpr auto kBudgetWords =
    std::to_array<Word<BudgetKind>>({{BudgetKind::data, "data"},
                                     {BudgetKind::tissue, "tissue"},
                                     {BudgetKind::computation, "computation"},
                                     {BudgetKind::device, "device"}});

BudgetLine line_between(const ErrorBudget& budget, const BudgetStage& from, const BudgetStage& to) {
  BudgetLine line;
  line.name = to.line;
  line.from = from.name;
  line.to = to.name;
  line.kind = to.kind;
  double squares = 0.0;
  for (std::size_t i = 0; i < budget.time_s.size(); ++i) {
    const double off = to.force_N[i] - from.force_N[i];
    line.difference_N.push_back(off);
    squares += off * off;
    if (std::abs(off) <= line.largest * budget.peak_N) continue;
    line.largest = std::abs(off) / budget.peak_N;
    line.largest_at_s = budget.time_s[i];
  }
  line.rms = std::sqrt(squares / static_cast<double>(budget.time_s.size())) / budget.peak_N;
  return line;
}

double largest_sum(const ErrorBudget& budget, const auto& wanted) {
  double largest = 0.0;
  for (std::size_t i = 0; i < budget.time_s.size(); ++i) {
    double sum = 0.0;
    for (const BudgetLine& line : budget.lines) {
      if (wanted(line)) sum += line.difference_N[i];
    }
    largest = std::max(largest, std::abs(sum));
  }
  return largest / budget.peak_N;
}

std::string part_text(double part) {
  return significant(100.0 * part, 3) + " %";
}

Remark noticeable_remark(const ErrorBudget& budget) {
  const double all = budget.combined;
  if (all < kForceJnd) {
    // Without a recording the chain begins with the law: its own error is in no line.
    const bool compared = std::ranges::any_of(
        budget.lines, [](const BudgetLine& line) { return line.name == "law"; });
    return {"not_noticeable",
            fmt::format(
                "the whole chain ({}) stays below the just noticeable difference of a force ({}): "
                "measuring or computing finer would not be felt{}",
                part_text(all), part_text(kForceJnd),
                compared ? "" : ", if the law is right: no recording is compared with it")};
  }
  if (all < kStiffnessThroughTool) {
    return {
        "noticeable_as_force",
        fmt::format("the whole chain ({}) may be felt as a force (from {} on); the just noticeable "
                    "difference of a stiffness felt through a tool is {}",
                    part_text(all), part_text(kForceJnd), part_text(kStiffnessThroughTool))};
  }
  return {"noticeable",
          fmt::format("the whole chain ({}) is above every threshold of a hand listed here",
                      part_text(all))};
}

Remark finer_remark(const ErrorBudget& budget) {
  constexpr double kFiner = 0.3;  // of the data's part: in quadrature 4 % of it
  if (!(budget.data_part > 0.0))
    return {"data_part_unknown", "the data uncertainty is not known: no fit stands behind it"};
  if (budget.computed_part < kFiner * budget.data_part) {
    return {
        "finer_is_wasted",
        fmt::format("data uncertainty {}, lost by computing {}: computing finer would be wasted",
                    part_text(budget.data_part), part_text(budget.computed_part))};
  }
  return {"finer_pays",
          fmt::format("what is lost by computing ({}) is not small against the data uncertainty "
                      "({}): computing finer pays",
                      part_text(budget.computed_part), part_text(budget.data_part))};
}

Remark largest_remark(const ErrorBudget& budget) {
  const auto most = std::ranges::max_element(
      budget.lines, [](const auto& a, const auto& b) { return a.largest < b.largest; });
  if (budget.random && budget.random->largest > most->largest) {
    return {"largest_is_parameters",
            fmt::format("the largest is the uncertainty of the law's parameters, {} of the peak",
                        part_text(budget.random->largest))};
  }
  return {"largest_is_line",
          fmt::format("the largest line is {}, {} of the peak at {} s", most->name,
                      part_text(most->largest), significant(most->largest_at_s, 4))};
}

}  // namespace

std::string_view budget_kind_name(BudgetKind kind) noexcept {
  return entry_of(kBudgetWords, kind).text;
}

ErrorBudget budget_of(std::vector<double> time_s, std::vector<BudgetStage> stages) {
  if (stages.size() < 2) {
    throw bad_input("budget", fmt::format("{} stages", stages.size()), "two or more");
  }
  ErrorBudget budget;
  budget.time_s = std::move(time_s);
  for (const BudgetStage& stage : stages) {
    if (stage.force_N.size() == budget.time_s.size() &&
        std::ranges::all_of(stage.force_N, [](double f) { return std::isfinite(f); })) {
      continue;
    }
    throw bad_input(fmt::format("budget: stage {}", stage.name),
                    fmt::format("{} forces for {} times, or one that is not finite",
                                stage.force_N.size(), budget.time_s.size()),
                    "a finite force at each time");
  }
  budget.stages = std::move(stages);
  // Parts of the peak of the model that begins the chain, not of readings that scatter.
  const BudgetStage& first = budget.stages.front();
  const BudgetStage& scale = first.name == "recording" ? budget.stages[1] : first;
  for (const double force : scale.force_N) budget.peak_N = std::max(budget.peak_N, std::abs(force));
  if (!(budget.peak_N > 0.0)) {
    throw bad_input("budget", "no force anywhere", "a motion that presses");
  }
  for (std::size_t i = 1; i < budget.stages.size(); ++i) {
    budget.lines.push_back(line_between(budget, budget.stages[i - 1], budget.stages[i]));
  }
  return budget;
}

void conclude(ErrorBudget& budget) {
  budget.total = largest_sum(budget, [](const BudgetLine&) { return true; });
  const BudgetStage &first = budget.stages.front(), &last = budget.stages.back();
  for (std::size_t i = 0; i < budget.time_s.size(); ++i) {
    double sum = 0.0;
    for (const BudgetLine& line : budget.lines) sum += line.difference_N[i];
    const double off = sum - (last.force_N[i] - first.force_N[i]);
    budget.not_closed = std::max(budget.not_closed, std::abs(off) / budget.peak_N);
  }
  const double scatter = std::hypot(budget.random ? budget.random->largest : 0.0,
                                    budget.instrument ? budget.instrument->largest : 0.0);
  budget.combined = std::hypot(budget.total, scatter);
  const double law =
      largest_sum(budget, [](const BudgetLine& line) { return line.kind == BudgetKind::data; });
  budget.data_part = std::hypot(law, scatter);
  budget.computed_part = largest_sum(
      budget, [](const BudgetLine& line) { return line.kind == BudgetKind::computation; });
  budget.sentences = {largest_remark(budget), finer_remark(budget), noticeable_remark(budget)};
}

double tolerance_of_data(const Json& budget, std::string_view where) {
  const bool known = budget.is_object() && budget.contains("data_part") &&
                     budget.at("data_part").is_number() && budget.contains("lines");
  if (!known) throw bad_input(where, "is no budget", "budget.json of tpm budget --folder");
  const double part = budget.at("data_part").get<double>();
  if (part > 0.0) return part;
  throw bad_input(where, "knows nothing of the data", "a budget of a law that was fitted");
}

}  // namespace tpm::fit
