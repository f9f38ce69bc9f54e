#include "tpm/fit/show/design_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "tpm/base/text.hpp"

namespace tpm::fit {
namespace {

/// The two things about a protocol that a figure varies.
struct Direction {
  std::string id;
  std::string quantity;  ///< of the x axis
  std::string unit;
  double to_si;
  double PlannedExperiment::*along;
  std::string curve;  ///< name of a curve, with {} for its value
  double curve_to_si;
  double PlannedExperiment::*across;
};

std::vector<Direction> directions() {
  return {{"design_hold", "hold", "s", 1.0, &PlannedExperiment::hold_s, "ramp at {} mm/s", 1e-3,
           &PlannedExperiment::rate_m_per_s},
          {"design_rate", "ramp rate", "mm/s", 1e-3, &PlannedExperiment::rate_m_per_s, "held {} s",
           1.0, &PlannedExperiment::hold_s}};
}

bool same_slice(const PlannedExperiment& a, const PlannedExperiment& b) {
  return a.kind == b.kind && a.depth_m == b.depth_m && a.load_N == b.load_N &&
         a.interval_s == b.interval_s && a.repeats == b.repeats;
}

/// Standard error from which a parameter is not known at all, % of its value: the top of an axis
/// that has something below it.
constexpr double kUnknown_percent = 100.0;

/// True if a logarithmic axis can show it.
bool drawable(const DesignCandidate& c, const Direction& d, const ExpectedParameter& p) {
  return c.experiment.*d.along > 0.0 && std::isfinite(p.relative_error) && p.relative_error > 0.0;
}

Panel parameter_panel(const DesignResult& result, const Direction& d, std::size_t i) {
  const PlannedExperiment& best = result.ranked.front().experiment;
  std::map<double, std::map<double, double>> curves;
  for (const DesignCandidate& c : result.ranked) {
    const ExpectedParameter& p = c.expected.parameters[i];
    if (!same_slice(c.experiment, best) || !drawable(c, d, p)) continue;
    curves[c.experiment.*d.across][c.experiment.*d.along / d.to_si] = 100.0 * p.relative_error;
  }
  Panel panel{result.problem.parameter(i).name,
              {d.quantity, d.unit, true},
              {"expected relative standard error", "%", true}};
  double least = kUnknown_percent, most = 0.0;
  for (const auto& [across, points] : curves) {
    Series s =
        line(fmt::format(fmt::runtime(d.curve), significant(across / d.curve_to_si, 4)), {}, {});
    for (const auto& [x, y] : points) {
      s.add(x, y);
      least = std::min(least, y);
      most = std::max(most, y);
    }
    panel.series.push_back(std::move(s));
  }
  if (least < kUnknown_percent && most > kUnknown_percent) panel.y.upper = kUnknown_percent;
  const ExpectedParameter& expected = result.ranked.front().expected.parameters[i];
  if (drawable(result.ranked.front(), d, expected)) {
    panel.series.push_back({.kind = Series::Kind::points,
                            .label = "best candidate",
                            .provenance = "model",
                            .x = {best.*d.along / d.to_si},
                            .y = {100.0 * expected.relative_error}});
  }
  return panel;
}

std::size_t values_along(const DesignResult& result, const Direction& d) {
  std::set<double> values;
  for (const DesignCandidate& c : result.ranked) {
    if (same_slice(c.experiment, result.ranked.front().experiment)) {
      values.insert(c.experiment.*d.along);
    }
  }
  return values.size();
}

Figure empty_figure(const DesignResult& result, const Direction& d, std::size_t sheet) {
  return {sheet == 1 ? d.id : fmt::format("{}_{}", d.id, sheet),
          fmt::format("What the {} decides", d.quantity),
          fmt::format("Expected standard errors from the Fisher information; otherwise as in the "
                      "best candidate: {}.",
                      experiment_words(result.ranked.front().experiment))};
}

}  // namespace

std::vector<Figure> design_figures(const DesignResult& result) {
  // Beside more panels the numbers of the axes run into each other.
  constexpr std::size_t kPanels = 3;
  std::vector<Figure> figures;
  for (const Direction& d : directions()) {
    if (values_along(result, d) < 2) continue;
    std::size_t sheet = 0;
    std::size_t free = 0;
    for (std::size_t i = 0; i < result.problem.config.parameters.size(); ++i) {
      Panel panel = parameter_panel(result, d, i);
      if (panel.series.empty()) continue;
      if (free == 0) {
        figures.push_back(empty_figure(result, d, ++sheet));
        free = kPanels;
      }
      figures.back().panels.push_back(std::move(panel));
      --free;
    }
  }
  return figures;
}

}  // namespace tpm::fit
