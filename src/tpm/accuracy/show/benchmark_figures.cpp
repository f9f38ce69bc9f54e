// Declared in tpm/accuracy/show/benchmark_report.hpp.
// Error against cost, one figure of wall time and one of counts for each problem.
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "tpm/accuracy/show/benchmark_report.hpp"
#include "tpm/base/lists.hpp"
#include "tpm/base/text.hpp"

namespace tpm::accuracy {
namespace {

/// Longest step that a servo loop of 1 kHz can use.
constexpr double kServoStep_s = 1e-3 * (1.0 + 1e-9);

/// Cost of a setting, with the quartiles where it was measured.
struct Cost {
  double value = 0.0;
  double lower = 0.0, upper = 0.0;
};

/// None: the setting does not belong into the panel.
using CostOf = std::function<std::optional<Cost>(const BenchmarkPoint&)>;

/// Simulated time of a run; the whole time for a run that never moved.
double simulated_s(const BenchmarkPoint& point, const BenchmarkResult& result) {
  return point.end_time_s > 0.0 ? point.end_time_s : result.simulated_s;
}

CostOf wall_per_second(const BenchmarkResult& result) {
  return [&result](const BenchmarkPoint& point) -> std::optional<Cost> {
    const double s = simulated_s(point, result);
    const BenchmarkTimes& t = point.times.value();
    return Cost{t.median_s / s, t.lower_quartile_s / s, t.upper_quartile_s / s};
  };
}

CostOf wall_per_step() {
  return [](const BenchmarkPoint& point) -> std::optional<Cost> {
    if (!point.step_s || *point.step_s > kServoStep_s) return std::nullopt;
    if (point.step_times) {
      return Cost{point.step_times->median_s, point.step_times->median_s, point.step_times->p99_s};
    }
    if (point.work.steps == 0) return std::nullopt;
    const auto steps = static_cast<double>(point.work.steps);
    const BenchmarkTimes& t = point.times.value();
    return Cost{t.median_s / steps, t.lower_quartile_s / steps, t.upper_quartile_s / steps};
  };
}

CostOf count_per_second(const BenchmarkResult& result, long MethodWork::*count) {
  return [&result, count](const BenchmarkPoint& point) -> std::optional<Cost> {
    if (point.work.*count == 0) return std::nullopt;
    const double per_s = static_cast<double>(point.work.*count) / simulated_s(point, result);
    return Cost{per_s, per_s, per_s};
  };
}

Series trail_of(const BenchmarkResult& result, const std::string& curve, const CostOf& cost_of,
                bool spread) {
  Series s{.kind = Series::Kind::trail, .label = curve, .provenance = "model"};
  for (const BenchmarkPoint& point : result.points) {
    if (point.curve() != curve || point.failed()) continue;
    const std::optional<Cost> cost = cost_of(point);
    if (!cost) continue;
    s.add(cost->value, point.error);
    if (!spread) continue;
    s.lower.push_back(cost->lower);
    s.upper.push_back(cost->upper);
  }
  return s;
}

/// The failures of a curve that have a word in common.
Series failed_of(const BenchmarkResult& result, const std::string& curve, const std::string& end,
                 const CostOf& cost_of) {
  Series s{
      .kind = Series::Kind::failed, .label = curve, .provenance = "model", .text = spaced(end)};
  for (const BenchmarkPoint& point : result.points) {
    if (point.curve() != curve || point.end != end || end == "not_applicable") continue;
    if (const std::optional<Cost> cost = cost_of(point)) s.x.push_back(cost->value);
  }
  return s;
}

bool has_end(const BenchmarkResult& result, const std::string& curve, const std::string& end) {
  return std::any_of(result.points.begin(), result.points.end(),
                     [&](const BenchmarkPoint& p) { return p.curve() == curve && p.end == end; });
}

constexpr std::array<const char*, 6> kFailures{
    "not_applicable", "too_much_work", "buckled", "newton_failed", "diverged", "error_above_peak"};

Series limit(Series::Kind kind, double place, std::string text) {
  Series s{.kind = kind, .provenance = "model", .text = std::move(text)};
  (kind == Series::Kind::level ? s.y : s.x).push_back(place);
  return s;
}

/// @param words_too what cannot be placed by its cost (not applicable) is named as well
void add_points(Panel& panel, const BenchmarkResult& result, const CostOf& cost_of, bool spread,
                bool words_too) {
  for (const std::string& curve : curves_of(result)) {
    panel.series.push_back(trail_of(result, curve, cost_of, spread));
  }
  for (const char* end : kFailures) {
    for (const std::string& curve : curves_of(result)) {
      if (!has_end(result, curve, end)) continue;
      Series failed = failed_of(result, curve, end, cost_of);
      if (words_too || !failed.x.empty()) panel.series.push_back(std::move(failed));
    }
  }
  panel.series.push_back(limit(Series::Kind::level, result.reference.floor, "reference known to"));
  for (const double error : each_once(result.targets, &BenchmarkTarget::error)) {
    panel.series.push_back(limit(Series::Kind::level, error,
                                 fmt::format("asked for: {} %", significant(100.0 * error, 2))));
  }
}

/// A panel of failures alone shows no choice.
bool any_completed(const Panel& panel) {
  return std::any_of(panel.series.begin(), panel.series.end(),
                     [](const Series& s) { return s.kind == Series::Kind::trail && !s.x.empty(); });
}

Axis error_axis(const BenchmarkResult& result) {
  return {fmt::format("error of the {} over its peak", result.response), "", true};
}

Figure wall_figure(const BenchmarkResult& result) {
  Figure figure{result.name, fmt::format("{}: error against wall time", result.title),
                "Each point is one setting of a method, median and quartiles of its repeats. Above "
                "the panels: settings that failed, at the cost at which they did. (a) Left of the "
                "line a method keeps up with real time."};
  Panel per_second{
      "(a) all settings", {"wall time per simulated second", "s/s", true}, error_axis(result)};
  add_points(per_second, result, wall_per_second(result), true, true);
  per_second.series.push_back(limit(Series::Kind::upright, 1.0, "real time"));
  figure.panels.push_back(std::move(per_second));
  Panel per_step{
      "(b) fixed steps of 1 ms or less", {"wall time of a step", "s", true}, error_axis(result)};
  add_points(per_step, result, wall_per_step(), true, false);
  if (any_completed(per_step)) {
    figure.caption +=
        " (b) Only what a servo loop can use: one step has to fit the period, 1 ms at 1 kHz and "
        "0.25 ms at 4 kHz.";
    per_step.series.push_back(limit(Series::Kind::upright, 2.5e-4, "4 kHz"));
    per_step.series.push_back(limit(Series::Kind::upright, 1e-3, "1 kHz"));
    figure.panels.push_back(std::move(per_step));
  }
  return figure;
}

Figure count_figure(const BenchmarkResult& result) {
  Figure figure{result.name + "_counts", fmt::format("{}: error against work", result.title),
                "The same against counts, which do not depend on the machine. (a) Evaluations of "
                "the forces of all bonds, or of the right-hand side; (b) factorisations of a "
                "stiffness or Newton matrix. What counts none of them is not in the panel."};
  Panel rates{"(a)", {"evaluations per simulated second", "1/s", true}, error_axis(result)};
  add_points(rates, result, count_per_second(result, &MethodWork::rates), false, true);
  figure.panels.push_back(std::move(rates));
  Panel factors{"(b)", {"factorisations per simulated second", "1/s", true}, error_axis(result)};
  add_points(factors, result, count_per_second(result, &MethodWork::factorisations), false, false);
  if (any_completed(factors)) figure.panels.push_back(std::move(factors));
  return figure;
}

}  // namespace

std::vector<Figure> benchmark_figures(const BenchmarkRecord& record) {
  std::vector<Figure> figures;
  for (const BenchmarkResult& result : record.results) {
    if (record.options.timing) figures.push_back(wall_figure(result));
    // Contact models count nothing: their work is that of a step.
    if (result.targets.empty()) figures.push_back(count_figure(result));
  }
  return figures;
}

}  // namespace tpm::accuracy
