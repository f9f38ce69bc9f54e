// Declared in tpm/sweep/show/sweep_report.hpp.
// Tables and figures of sensitivity indices; sweep_report.cpp has those of the sweeps themselves.
#include <fmt/format.h>

#include "tpm/base/text.hpp"
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
  const Axis parameters{"parameter", "", false, 0.5, static_cast<double>(value.x.size()) + 0.5,
                        s.parameters};
  return {what, parameters, {what, ""}, {std::move(interval), std::move(value)}};
}

}  // namespace

std::string sensitivity_text(const std::vector<SweepSensitivity>& all) {
  std::string text;
  const auto words = [](const IndexEstimate& e) {
    return fmt::format("{:7.4f} ({:.4f} to {:.4f})", e.value, e.low, e.high);
  };
  for (const SweepSensitivity& s : all) {
    text += fmt::format("{}{}: mean {}, standard deviation {} (SI), {} replicates of {} points",
                        text.empty() ? "" : "\n", s.variable, significant(s.indices.mean, 4),
                        significant(s.indices.standard_deviation, 4), s.design.replicates,
                        s.design.points);
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
    figures.push_back(
        {fmt::format("sensitivity_{}", s.variable),
         s.variable,
         fmt::format("{}: shares of the variance of {} with 95 % intervals.", title, s.variable),
         {index_panel("first-order index", s, &InputSensitivity::first_order),
          index_panel("total index", s, &InputSensitivity::total)},
         s.fixed.empty() ? std::string() : fixed_words(s.fixed, 4).substr(1)});
  }
  return figures;
}

}  // namespace tpm::sweep
