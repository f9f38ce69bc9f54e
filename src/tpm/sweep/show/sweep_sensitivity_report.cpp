// Declared in tpm/sweep/show/sweep_report.hpp.
// Tables and figures of sensitivity indices; sweep_report.cpp has those of the sweeps themselves.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numeric>

#include "tpm/base/lists.hpp"
#include "tpm/base/sized_unit.hpp"
#include "tpm/base/text.hpp"
#include "tpm/show/table_document.hpp"
#include "tpm/sweep/show/sweep_report.hpp"

namespace tpm::sweep {
namespace {

/// Indices beside each other, with their intervals; `of` picks one of the two kinds.
Panel index_panel(const std::string& what, const SweepSensitivity& s,
                  IndexEstimate InputSensitivity::*of) {
  Series interval{.kind = Series::Kind::bracket, .label = "95 % interval", .provenance = "model"};
  Series value{.kind = Series::Kind::points, .label = "index", .provenance = "model"};
  for (std::size_t i = 0; i < s.parameters.size(); ++i) {
    const IndexEstimate& index = s.indices.inputs[i].*of;
    interval.add_range(static_cast<double>(i + 1), index.low, index.high);
    value.y.push_back(index.value);
  }
  value.x = interval.x;
  const Axis parameters{"parameter",
                        "",
                        false,
                        0.5,
                        static_cast<double>(value.x.size()) + 0.5,
                        mapped<std::string>(s.parameters, printed)};
  return {what, parameters, {what, ""}, {std::move(interval), std::move(value)}};
}

/// "mean 0.51 N, standard deviation 43 mN"
std::string spread_words(const SweepSensitivity& s) {
  const Unit unit = shown_unit_of(s.unit);
  return fmt::format("mean {}, standard deviation {}", sized_text(unit, s.indices.mean, 4),
                     sized_text(unit, s.indices.standard_deviation, 4));
}

/// "E2 0.81 (0.79 to 0.83)", for parameters by falling total index.
std::string decisive_words(const SweepSensitivity& s, std::size_t most) {
  std::vector<std::size_t> order(s.indices.inputs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{},
                           [&](std::size_t i) { return s.indices.inputs[i].total.value; });
  const std::size_t shown = std::min(order.size(), most);
  order.resize(shown);
  std::string words = listed(order, [&](std::size_t i) {
    const IndexEstimate& total = s.indices.inputs[i].total;
    return fmt::format("{} {:.2f} ({:.2f} to {:.2f})", s.parameters[i], total.value, total.low,
                       total.high);
  });
  const std::size_t more = s.indices.inputs.size() - shown;
  return more == 0 ? words : fmt::format("{}; {} less", words, more);
}

}  // namespace

ShortAnswer short_answer(const std::vector<SweepSensitivity>& all, const std::string& title) {
  constexpr std::size_t kShownParameters = 3;
  ShortAnswer answer;
  if (!title.empty()) answer.conclusion.push_back(title);
  answer.conclusion.emplace_back(
      "total Sobol index: the share of the variance that is left when all other parameters are "
      "known");
  std::vector<std::vector<std::string>> table{{"", "mean", "std. dev.", "total index (95 %)"}};
  for (const SweepSensitivity& s : all) {
    const Unit unit = sized_unit(shown_unit_of(s.unit), s.indices.mean);
    table.push_back(
        {s.variable + fixed_words(s.fixed, 4), value_words(s.indices.mean, unit, 4),
         value_words(s.indices.standard_deviation, unit, 4),
         s.indices.inputs.empty() ? "does not vary" : decisive_words(s, kShownParameters)});
    if (s.indices.left_out > 0) {
      answer.warnings.push_back(fmt::format("{}: {} points without a number are left out",
                                            s.variable, s.indices.left_out));
    }
  }
  answer.rows = separate_lines(aligned(table));
  answer.head = {answer.rows.front()};
  answer.rows.erase(answer.rows.begin());
  return answer;
}

std::string sensitivity_text(const std::vector<SweepSensitivity>& all) {
  std::string text;
  const auto words = [](const IndexEstimate& e) {
    return fmt::format("{:7.4f} ({:.4f} to {:.4f})", e.value, e.low, e.high);
  };
  for (const SweepSensitivity& s : all) {
    text += fmt::format("{}{}: {}, {} replicates of {} points", text.empty() ? "" : "\n",
                        s.variable, spread_words(s), s.design.replicates, s.design.points);
    if (s.indices.left_out > 0) text += fmt::format(", {} points left out", s.indices.left_out);
    if (!s.fixed.empty()) text += "," + fixed_words(s.fixed, 4);
    text += "\n";
    if (s.indices.inputs.empty()) {
      text += "it does not vary\n";
      continue;
    }
    text +=
        fmt::format("{:<12} {:<28} {:<28}\n", "parameter", "first order (95 %)", "total (95 %)");
    for (std::size_t i = 0; i < s.parameters.size(); ++i) {
      text += fmt::format("{:<12} {:<28} {:<28}\n", s.parameters[i],
                          words(s.indices.inputs[i].first_order), words(s.indices.inputs[i].total));
    }
  }
  return text;
}

Json sensitivity_json(const std::vector<SweepSensitivity>& all) {
  const auto numbers = [](const IndexEstimate& e) {
    return Json{{"value", rounded(e.value)}, {"low", rounded(e.low)}, {"high", rounded(e.high)}};
  };
  Json list = array_json(all, [&](const SweepSensitivity& s) {
    Json inputs = Json::array();
    for (std::size_t i = 0; i < s.indices.inputs.size(); ++i) {
      inputs.push_back({{"parameter", s.parameters[i]},
                        {"first_order", numbers(s.indices.inputs[i].first_order)},
                        {"total", numbers(s.indices.inputs[i].total)}});
    }
    return Json{{"variable", s.variable},
                {"unit", s.unit},
                {"mean", rounded(s.indices.mean)},
                {"standard_deviation", rounded(s.indices.standard_deviation)},
                {"level", s.indices.level},
                {"points", s.design.points},
                {"replicates", s.design.replicates},
                {"points_left_out", s.indices.left_out},
                {"fixed", fixed_json(s.fixed)},
                {"inputs", std::move(inputs)}};
  });
  return Json{{"sensitivity", std::move(list)}};
}

std::vector<Figure> sensitivity_figures(const std::vector<SweepSensitivity>& all,
                                        const std::string& title) {
  std::vector<Figure> figures;
  for (const SweepSensitivity& s : all) {
    if (s.indices.inputs.empty()) continue;  // it does not vary
    figures.push_back({fmt::format("sensitivity_{}", s.variable),
                       printed(s.variable),
                       fmt::format("{}: shares of the variance of {} with 95 % intervals.", title,
                                   printed(s.variable)),
                       {index_panel("first-order index", s, &InputSensitivity::first_order),
                        index_panel("total index", s, &InputSensitivity::total)},
                       s.fixed.empty() ? std::string() : fixed_words(s.fixed, 4).substr(1)});
  }
  return figures;
}

}  // namespace tpm::sweep
