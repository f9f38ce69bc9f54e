// Declared in tpm/accuracy/show/benchmark_report.hpp.
#include <cmath>

#include "tpm/accuracy/show/benchmark_report.hpp"
#include "tpm/show/result_table.hpp"

namespace tpm::accuracy {
namespace {

using Point = BenchmarkPoint;
using PointColumn = ResultColumn<Point>;
constexpr int kCellDigits = 5;

/// A number of what a point may have.
template <class Part, class Number>
PointColumn part(const char* key, std::optional<Part> Point::*of, Number Part::*number) {
  const auto value = [of, number](const Point& p) {
    return p.*of ? std::optional<Number>(*(p.*of).*number) : std::nullopt;
  };
  return {key, value, kCellDigits};
}

/// A number that is not there for all points.
template <class Known, class Number>
PointColumn number_if(const char* key, const Known& known, const Number& number) {
  const auto value = [=](const Point& p) {
    return known(p) ? Json(std::invoke(number, p)) : Json();
  };
  return {key, value, kCellDigits};
}

/// Columns behind the problem's.
std::vector<PointColumn> setting_columns() {
  const auto finite = [](const Point& p) { return std::isfinite(p.error); };
  return {{"method", &Point::method},
          {"variant", &Point::variant},
          {"parameter", &Point::parameter},
          number_if(
              "value", [](const Point& p) { return !p.parameter.empty(); }, &Point::value),
          {"end", &Point::end},
          {"error", &Point::error, kCellDigits},
          number_if("below_floor", finite, &Point::below_floor),
          {"end_time_s", &Point::end_time_s, kCellDigits},
          {"steps", [](const Point& p) { return p.work.steps; }},
          {"rates", [](const Point& p) { return p.work.rates; }},
          {"factorisations", [](const Point& p) { return p.work.factorisations; }},
          {"solves", [](const Point& p) { return p.work.solves; }},
          part("claimed_error", &Point::claims, &BenchmarkClaims::largest),
          part("claimed_over_true_median", &Point::claims, &BenchmarkClaims::median),
          part("claimed_share_covered", &Point::claims, &BenchmarkClaims::covered),
          {"reason", &Point::reason}};
}

/// Of a record with times: every point has them.
std::vector<PointColumn> time_columns() {
  using Times = BenchmarkTimes;
  using Steps = BenchmarkStepTimes;
  const auto wall = [](const Point& p) { return p.times.value().median_s / p.end_time_s; };
  return {part("repeats", &Point::times, &Times::repeats),
          part("runs_per_repeat", &Point::times, &Times::runs_per_repeat),
          part("wall_median_s", &Point::times, &Times::median_s),
          part("wall_lower_quartile_s", &Point::times, &Times::lower_quartile_s),
          part("wall_upper_quartile_s", &Point::times, &Times::upper_quartile_s),
          part("wall_least_s", &Point::times, &Times::least_s),
          number_if(
              "wall_per_simulated_s", [](const Point& p) { return p.end_time_s > 0.0; }, wall),
          part("step_median_s", &Point::step_times, &Steps::median_s),
          part("step_p99_s", &Point::step_times, &Steps::p99_s),
          part("step_largest_s", &Point::step_times, &Steps::largest_s),
          number_if(
              "build_s", [](const Point& p) { return p.build_s > 0.0; }, &Point::build_s)};
}

}  // namespace

std::string benchmark_csv(const BenchmarkResult& result, bool timing) {
  std::vector<PointColumn> columns = setting_columns();
  columns.emplace(columns.begin(), "problem", [&](const Point&) { return result.name; });
  if (timing) {
    for (PointColumn& column : time_columns()) columns.push_back(std::move(column));
  }
  return ResultTable<Point>(std::move(columns)).csv(result.points);
}

}  // namespace tpm::accuracy
