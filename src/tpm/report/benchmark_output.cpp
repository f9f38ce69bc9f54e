#include "tpm/report/benchmark_report.hpp"

#include <cmath>

#include "tpm/core/text.hpp"
#include "tpm/report/table_document.hpp"

namespace tpm::report {
namespace {

constexpr int kBenchmarkDigits = 5;

std::string number(double value) {
  return significant(value, kBenchmarkDigits);
}

double stored(double value) {
  return rounded(value, kBenchmarkDigits);
}

using Cells = std::vector<std::string>;

const Cells kColumns{"problem",
                     "method",
                     "variant",
                     "parameter",
                     "value",
                     "end",
                     "error",
                     "below_floor",
                     "end_time_s",
                     "steps",
                     "rates",
                     "factorisations",
                     "solves",
                     "claimed_error",
                     "claimed_over_true_median",
                     "claimed_share_covered",
                     "reason"};
const Cells kTimeColumns{"repeats",
                         "runs_per_repeat",
                         "wall_median_s",
                         "wall_lower_quartile_s",
                         "wall_upper_quartile_s",
                         "wall_least_s",
                         "wall_per_simulated_s",
                         "step_median_s",
                         "step_p99_s",
                         "step_largest_s",
                         "build_s"};

Cells cells_of(const BenchmarkResult& result, const BenchmarkPoint& p) {
  return {result.name,
          p.method,
          p.variant,
          p.parameter,
          p.parameter.empty() ? "" : number(p.value),
          p.end,
          std::isfinite(p.error) ? number(p.error) : "",
          std::isfinite(p.error) ? (p.below_floor ? "yes" : "no") : "",
          number(p.end_time_s),
          std::to_string(p.work.steps),
          std::to_string(p.work.rates),
          std::to_string(p.work.factorisations),
          std::to_string(p.work.solves),
          p.claims ? number(p.claims->largest) : "",
          p.claims ? number(p.claims->median) : "",
          p.claims ? number(p.claims->covered) : "",
          p.reason};
}

void append_times(Cells& cells, const BenchmarkPoint& p) {
  const BenchmarkTimes& t = p.times.value();
  const double simulated_s = p.end_time_s;
  for (const std::string& cell :
       {std::to_string(t.repeats), std::to_string(t.runs_per_repeat), number(t.median_s),
        number(t.lower_quartile_s), number(t.upper_quartile_s), number(t.least_s),
        simulated_s > 0.0 ? number(t.median_s / simulated_s) : std::string()}) {
    cells.push_back(cell);
  }
  if (p.step_times) {
    for (const double time :
         {p.step_times->median_s, p.step_times->p99_s, p.step_times->largest_s}) {
      cells.push_back(number(time));
    }
  } else {
    cells.insert(cells.end(), 3, "");
  }
  cells.push_back(p.build_s > 0.0 ? number(p.build_s) : std::string());
}

Json point_json(const BenchmarkPoint& p, bool timing) {
  Json json{{"method", p.method}};
  if (!p.variant.empty()) json["variant"] = p.variant;
  if (!p.parameter.empty()) json[p.parameter] = stored(p.value);
  if (p.step_s) json["step_s"] = stored(*p.step_s);
  json["end"] = p.end;
  if (!p.reason.empty()) json["reason"] = p.reason;
  if (std::isfinite(p.error)) {
    json["error"] = stored(p.error);
    json["below_floor"] = p.below_floor;
  }
  json["end_time_s"] = stored(p.end_time_s);
  json["steps"] = p.work.steps;
  json["rates"] = p.work.rates;
  json["factorisations"] = p.work.factorisations;
  json["solves"] = p.work.solves;
  if (p.claims) {
    json["claims"] = {{"largest_error", stored(p.claims->largest)},
                      {"median_over_true", stored(p.claims->median)},
                      {"share_covered", stored(p.claims->covered)}};
  }
  if (!timing) return json;
  const BenchmarkTimes& t = p.times.value();
  json["repeats"] = t.repeats;
  json["runs_per_repeat"] = t.runs_per_repeat;
  json["wall_s"] = {{"median", stored(t.median_s)},
                    {"lower_quartile", stored(t.lower_quartile_s)},
                    {"upper_quartile", stored(t.upper_quartile_s)},
                    {"least", stored(t.least_s)}};
  if (p.step_times) {
    json["step_wall_s"] = {{"median", stored(p.step_times->median_s)},
                           {"p99", stored(p.step_times->p99_s)},
                           {"largest", stored(p.step_times->largest_s)}};
  }
  if (p.build_s > 0.0) json["build_s"] = stored(p.build_s);
  return json;
}

Json result_json(const BenchmarkResult& result, bool timing) {
  const BenchmarkReference& reference = result.reference;
  Json json{{"name", result.name},
            {"title", result.title},
            {"text", result.text},
            {"response", result.response},
            {"simulated_s", stored(result.simulated_s)}};
  if (result.relaxation_time_s > 0.0) {
    json["relaxation_time_s"] = stored(result.relaxation_time_s);
  }
  for (const BenchmarkTarget& target : result.targets) {
    Json one{
        {"curve", target.curve}, {"error", target.error}, {"step_median_s", target.step_median_s}};
    if (target.step_p99_s > 0.0) one["step_p99_s"] = target.step_p99_s;
    if (target.build_s > 0.0) one["build_s"] = target.build_s;
    json["targets"].push_back(std::move(one));
  }
  json["reference"] = {
      {"first", reference.first.words},   {"first_method", reference.first.method},
      {"second", reference.second.words}, {"second_method", reference.second.method},
      {"exact", reference.exact},         {"peak", stored(reference.peak)},
      {"peak_unit", result.unit},         {"agreement", stored(reference.agreement)},
      {"floor", stored(reference.floor)}};
  json["points"] = Json::array();
  for (const BenchmarkPoint& point : result.points) {
    json["points"].push_back(point_json(point, timing));
  }
  return json;
}

}  // namespace

std::string benchmark_csv(const BenchmarkResult& result, bool timing) {
  Cells header = kColumns;
  if (timing) header.insert(header.end(), kTimeColumns.begin(), kTimeColumns.end());
  std::string text = csv_line(header);
  for (const BenchmarkPoint& point : result.points) {
    Cells cells = cells_of(result, point);
    if (timing) append_times(cells, point);
    text += csv_line(cells);
  }
  return text;
}

Json to_json(const BenchmarkRecord& record) {
  Json json{{"timing", record.options.timing}};
  if (record.options.timing) json["repeats"] = record.options.repeats;
  json["problems"] = Json::array();
  for (const BenchmarkResult& result : record.results) {
    Json problem = result_json(result, record.options.timing);
    const auto run = record.runs.find(result.name);
    if (run != record.runs.end()) problem["run"] = run->second;
    json["problems"].push_back(std::move(problem));
  }
  return json;
}

}  // namespace tpm::report
