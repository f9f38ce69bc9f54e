// What an earlier run of tpm benchmark has left.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "tpm/report/benchmark_report.hpp"
#include "tpm/store/json.hpp"
#include "tpmkit/error.hpp"

namespace tpm::report {
namespace {

constexpr std::array<const char*, 3> kParameters{"relaxation_time_s", "tolerance", "step_s"};

std::string text_at(const Json& json, const char* key) {
  return json.contains(key) ? json.at(key).get<std::string>() : std::string();
}

double number_at(const Json& json, const char* key, double otherwise = 0.0) {
  return json.contains(key) ? json.at(key).get<double>() : otherwise;
}

void read_times(const Json& json, BenchmarkPoint& point) {
  if (json.contains("wall_s")) {
    const Json& wall = json.at("wall_s");
    point.times = BenchmarkTimes{
        json.at("repeats").get<int>(),           json.at("runs_per_repeat").get<long>(),
        wall.at("median").get<double>(),         wall.at("lower_quartile").get<double>(),
        wall.at("upper_quartile").get<double>(), wall.at("least").get<double>()};
  }
  if (json.contains("step_wall_s")) {
    const Json& step = json.at("step_wall_s");
    point.step_times =
        BenchmarkStepTimes{step.at("median").get<double>(), step.at("p99").get<double>(),
                           step.at("largest").get<double>()};
  }
  point.build_s = number_at(json, "build_s");
}

/// Of a point that the schema has let pass.
BenchmarkPoint read_point(const Json& json) {
  BenchmarkPoint point;
  point.method = json.at("method").get<std::string>();
  point.variant = text_at(json, "variant");
  const auto parameter = std::find_if(kParameters.begin(), kParameters.end(),
                                      [&](const char* key) { return json.contains(key); });
  if (parameter != kParameters.end()) {
    point.parameter = *parameter;
    point.value = json.at(*parameter).get<double>();
  }
  if (json.contains("step_s")) point.step_s = json.at("step_s").get<double>();
  point.end = json.at("end").get<std::string>();
  point.reason = text_at(json, "reason");
  point.error = number_at(json, "error", std::numeric_limits<double>::quiet_NaN());
  point.below_floor = json.contains("below_floor") && json.at("below_floor").get<bool>();
  point.end_time_s = json.at("end_time_s").get<double>();
  point.work = {json.at("steps").get<long>(), json.at("rates").get<long>(),
                json.at("factorisations").get<long>(), json.at("solves").get<long>()};
  if (json.contains("claims")) {
    const Json& claims = json.at("claims");
    point.claims = BenchmarkClaims{claims.at("median_over_true").get<double>(),
                                   claims.at("share_covered").get<double>(),
                                   claims.at("largest_error").get<double>()};
  }
  read_times(json, point);
  return point;
}

BenchmarkResult read_result(const Json& json) {
  BenchmarkResult result;
  result.name = json.at("name").get<std::string>();
  result.title = json.at("title").get<std::string>();
  result.text = json.at("text").get<std::string>();
  result.response = json.at("response").get<std::string>();
  result.simulated_s = json.at("simulated_s").get<double>();
  result.relaxation_time_s = number_at(json, "relaxation_time_s");
  if (json.contains("targets")) {
    for (const Json& target : json.at("targets")) {
      result.targets.push_back({target.at("curve").get<std::string>(),
                                target.at("error").get<double>(),
                                target.at("step_median_s").get<double>(),
                                number_at(target, "step_p99_s"), number_at(target, "build_s")});
    }
  }
  const Json& reference = json.at("reference");
  result.unit = reference.at("peak_unit").get<std::string>();
  result.reference.first.words = reference.at("first").get<std::string>();
  result.reference.first.method = reference.at("first_method").get<std::string>();
  result.reference.second.words = reference.at("second").get<std::string>();
  result.reference.second.method = reference.at("second_method").get<std::string>();
  result.reference.exact = reference.at("exact").get<bool>();
  result.reference.peak = reference.at("peak").get<double>();
  result.reference.agreement = reference.at("agreement").get<double>();
  result.reference.floor = reference.at("floor").get<double>();
  for (const Json& point : json.at("points")) result.points.push_back(read_point(point));
  return result;
}

std::size_t place_in_list(std::string_view name) {
  const auto entries = benchmark_entries();
  const auto at = std::find_if(entries.begin(), entries.end(),
                               [&](const BenchmarkEntry& e) { return e.name == name; });
  return static_cast<std::size_t>(at - entries.begin());
}

std::string options_words(const BenchmarkOptions& options) {
  return options.timing ? fmt::format("--repeats {}", options.repeats) : "--no-timing";
}

/// Of a document that the schema has let pass.
BenchmarkRecord read_record(const Json& json) {
  BenchmarkRecord record;
  record.options.timing = json.at("timing").get<bool>();
  if (record.options.timing) record.options.repeats = json.at("repeats").get<int>();
  for (const Json& problem : json.at("problems")) {
    record.results.push_back(read_result(problem));
    if (problem.contains("run")) record.runs[record.results.back().name] = problem.at("run");
  }
  return record;
}

}  // namespace

BenchmarkRecord read_benchmark(const std::filesystem::path& file) {
  const Json json = read_json(file);
  check_schema(json, "benchmark", file.string());
  return read_record(json);
}

KeptBenchmark keep_benchmark(const std::filesystem::path& folder, const BenchmarkOptions& options,
                             std::span<const std::string> named) {
  KeptBenchmark kept;
  kept.record.options = options;
  std::filesystem::path file = folder / kBenchmarkPart;
  if (!std::filesystem::exists(file)) file = folder / "benchmark.json";
  if (std::filesystem::exists(file)) {
    BenchmarkRecord there = read_benchmark(file);
    const bool alike = there.options.timing == options.timing &&
                       (!options.timing || there.options.repeats == options.repeats);
    if (!alike) {
      throw Error(ExitCode::usage, "--keep",
                  fmt::format("{} was made with {}", file.string(), options_words(there.options)),
                  "the same options, or another folder");
    }
    for (BenchmarkResult& result : there.results) {
      const std::string name = result.name;
      put_result(kept.record, std::move(result), there.runs[name]);
    }
  }
  for (const BenchmarkEntry& entry : chosen_benchmarks(named)) {
    const auto& results = kept.record.results;
    const bool there = std::any_of(results.begin(), results.end(),
                                   [&](const BenchmarkResult& r) { return r.name == entry.name; });
    if (!named.empty() || !there) kept.missing.push_back(entry);
  }
  return kept;
}

void put_result(BenchmarkRecord& record, BenchmarkResult result, Json run) {
  // As it will be read, so that a run that goes on writes the same bytes as one that was whole.
  result = read_record(to_json(BenchmarkRecord{{result}, record.options, {}})).results.front();
  if (record.options.timing && !run.is_null()) record.runs[result.name] = std::move(run);
  const auto at =
      std::find_if(record.results.begin(), record.results.end(), [&](const BenchmarkResult& other) {
        return place_in_list(other.name) >= place_in_list(result.name);
      });
  if (at != record.results.end() && at->name == result.name) {
    *at = std::move(result);
  } else {
    record.results.insert(at, std::move(result));
  }
}

}  // namespace tpm::report
