// Declared in tpm/accuracy/show/benchmark_report.hpp.
#include "tpm/accuracy/show/benchmark_report.hpp"

#include <array>
#include <cmath>

#include "tpm/base/text.hpp"
#include "tpm/show/table_document.hpp"

namespace tpm::accuracy {
namespace {

constexpr int kCellDigits = 5;

std::string number_cell(double value) {
  return significant(value, kCellDigits);
}

std::string number_cell_if(bool known, double value) {
  return known ? number_cell(value) : std::string();
}

/// A number of what a point may have; empty if it has none.
template <class Part>
std::string part_cell(const std::optional<Part>& all, double Part::*member) {
  return all ? number_cell(*all.*member) : std::string();
}

using Cells = std::vector<std::string>;

using Point = const BenchmarkPoint&;

/// A column, behind the problem's, and what stands in it.
struct BenchmarkColumn {
  const char* name;
  std::string (*cell)(Point point);
};

constexpr std::array<BenchmarkColumn, 16> kSettingColumns{
    {{"method", [](Point p) { return p.method; }},
     {"variant", [](Point p) { return p.variant; }},
     {"parameter", [](Point p) { return p.parameter; }},
     {"value", [](Point p) { return number_cell_if(!p.parameter.empty(), p.value); }},
     {"end", [](Point p) { return p.end; }},
     {"error", [](Point p) { return number_cell_if(std::isfinite(p.error), p.error); }},
     {"below_floor",
      [](Point p) {
        return std::string(!std::isfinite(p.error) ? "" : p.below_floor ? "yes" : "no");
      }},
     {"end_time_s", [](Point p) { return number_cell(p.end_time_s); }},
     {"steps", [](Point p) { return std::to_string(p.work.steps); }},
     {"rates", [](Point p) { return std::to_string(p.work.rates); }},
     {"factorisations", [](Point p) { return std::to_string(p.work.factorisations); }},
     {"solves", [](Point p) { return std::to_string(p.work.solves); }},
     {"claimed_error", [](Point p) { return part_cell(p.claims, &BenchmarkClaims::largest); }},
     {"claimed_over_true_median",
      [](Point p) { return part_cell(p.claims, &BenchmarkClaims::median); }},
     {"claimed_share_covered",
      [](Point p) { return part_cell(p.claims, &BenchmarkClaims::covered); }},
     {"reason", [](Point p) { return p.reason; }}}};

/// Of a record with times: every point has them.
constexpr std::array<BenchmarkColumn, 11> kTimeColumns{
    {{"repeats", [](Point p) { return std::to_string(p.times.value().repeats); }},
     {"runs_per_repeat", [](Point p) { return std::to_string(p.times.value().runs_per_repeat); }},
     {"wall_median_s", [](Point p) { return part_cell(p.times, &BenchmarkTimes::median_s); }},
     {"wall_lower_quartile_s",
      [](Point p) { return part_cell(p.times, &BenchmarkTimes::lower_quartile_s); }},
     {"wall_upper_quartile_s",
      [](Point p) { return part_cell(p.times, &BenchmarkTimes::upper_quartile_s); }},
     {"wall_least_s", [](Point p) { return part_cell(p.times, &BenchmarkTimes::least_s); }},
     {"wall_per_simulated_s",
      [](Point p) {
        return number_cell_if(p.end_time_s > 0.0, p.times.value().median_s / p.end_time_s);
      }},
     {"step_median_s",
      [](Point p) { return part_cell(p.step_times, &BenchmarkStepTimes::median_s); }},
     {"step_p99_s", [](Point p) { return part_cell(p.step_times, &BenchmarkStepTimes::p99_s); }},
     {"step_largest_s",
      [](Point p) { return part_cell(p.step_times, &BenchmarkStepTimes::largest_s); }},
     {"build_s", [](Point p) { return number_cell_if(p.build_s > 0.0, p.build_s); }}}};

}  // namespace

std::string benchmark_csv(const BenchmarkResult& result, bool timing) {
  std::vector<BenchmarkColumn> columns(kSettingColumns.begin(), kSettingColumns.end());
  if (timing) columns.insert(columns.end(), kTimeColumns.begin(), kTimeColumns.end());
  Cells names{"problem"};
  for (const BenchmarkColumn& column : columns) names.emplace_back(column.name);
  std::string text = csv_line(names);
  for (const BenchmarkPoint& point : result.points) {
    Cells cells{result.name};
    for (const BenchmarkColumn& column : columns) cells.push_back(column.cell(point));
    text += csv_line(cells);
  }
  return text;
}

}  // namespace tpm::accuracy
