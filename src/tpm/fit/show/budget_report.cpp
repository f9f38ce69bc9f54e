#include "tpm/fit/show/budget_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/plan/perception.hpp"
#include "tpm/show/draw.hpp"

namespace tpm::fit {
namespace {

std::size_t instant_of_largest_sum(const ErrorBudget& b) {
  std::size_t place = 0;
  double largest = -1.0;
  for (std::size_t i = 0; i < b.time_s.size(); ++i) {
    double sum = 0.0;
    for (const BudgetLine& line : b.lines) sum += line.difference_N[i];
    if (std::abs(sum) <= largest) continue;
    largest = std::abs(sum);
    place = i;
  }
  return place;
}

Panel waterfall_panel(const ErrorBudget& b) {
  const std::size_t at = instant_of_largest_sum(b);
  Panel panel{.title = fmt::format("adding up at {} s", significant(b.time_s[at], 4)),
              .x = {"", "", false, 0.5, 1.5 + static_cast<double>(b.lines.size())},
              .y = {"sum so far, of the peak", "%"}};
  Series steps{.kind = Series::Kind::bracket, .label = "line", .provenance = "derived"};
  Series sums{.kind = Series::Kind::points, .label = "sum so far", .provenance = "derived"};
  double sum = 0.0;
  for (const BudgetLine& l : b.lines) {
    const double next = sum + 100.0 * l.difference_N[at] / b.peak_N;
    const double x = static_cast<double>(panel.x.names.size() + 1);
    panel.x.names.push_back(l.name);
    steps.add_range(x, std::min(sum, next), std::max(sum, next));
    sums.add(x, next);
    sum = next;
  }
  panel.x.names.push_back("sum");
  const double end = static_cast<double>(panel.x.names.size());
  steps.add_range(end, std::min(sum, 0.0), std::max(sum, 0.0));
  panel.series = {std::move(steps), std::move(sums)};
  return panel;
}

Series threshold(const char* words, double share, double until) {
  return line(words, {0.5, until}, {100.0 * share, 100.0 * share}, "abstract");
}

Panel largest_panel(const ErrorBudget& b) {
  constexpr double kLeastDrawn = 1e-5;  // of the peak, on a logarithmic axis
  Panel panel{.title = "each line's own largest",
              .x = {"", "", false, 0.5},
              .y = {"of the peak", "%", true}};
  Series own{.kind = Series::Kind::points, .label = "largest of the line", .provenance = "derived"};
  const auto add = [&](const std::string& name, double part) {
    const bool drawn = part >= kLeastDrawn;
    panel.x.names.push_back(
        drawn ? name : fmt::format("{} (< {} %)", name, significant(100.0 * kLeastDrawn, 1)));
    if (drawn) own.add(static_cast<double>(panel.x.names.size()), 100.0 * part);
  };
  for (const BudgetLine& l : b.lines) add(l.name, l.largest);
  if (b.random) add("parameters", b.random->largest);
  add("all", b.combined);
  const double until = 0.5 + static_cast<double>(panel.x.names.size());
  panel.x.upper = until;
  add_if_any(panel, std::move(own));
  panel.series.push_back(threshold("a hand: force, 7 %", kForceJnd, until));
  panel.series.push_back(
      threshold("a hand: stiffness through a tool, 45 %", kStiffnessThroughTool, until));
  return panel;
}

}  // namespace

Figure budget_figure(const ErrorBudget& budget) {
  return {"budget",
          fmt::format("Error budget: {}", budget.title),
          fmt::format("Signed differences between neighbouring stages in parts of the peak ({} N), "
                      "added up at the "
                      "instant of their largest sum, and each line's own largest. {}.",
                      significant(budget.peak_N, 3),
                      budget.sentences.empty() ? "" : budget.sentences.front().text),
          {waterfall_panel(budget), largest_panel(budget)}};
}

std::vector<std::string> write_budget_report(const std::filesystem::path& folder,
                                             const ErrorBudget& budget) {
  std::vector<std::string> files{"budget.json", "budget.csv"};
  write_file(folder / files[0], to_text(to_json(budget)));
  write_file(folder / files[1], to_csv(budget));
  return write_figures(folder, {budget_figure(budget)}, std::move(files));
}

}  // namespace tpm::fit
