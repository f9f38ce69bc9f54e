// Declared in tpm/accuracy/show/benchmark_report.hpp.
// The record of tpm accuracy benchmark as JSON, both ways, and what an earlier run has left.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tpm/accuracy/show/benchmark_report.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

constexpr int kBenchmarkDigits = 5;
constexpr double kMostCounted = 9007199254740991.0;  // 2^53 - 1

/// A number; not written where it is not finite.
ValueType<double> measured_number(Range range = kZeroOrMore) {
  ValueType<double> type = number(range);
  type.write = [](const double& value) {
    return std::isfinite(value) ? Json(rounded(value, kBenchmarkDigits)) : Json();
  };
  return type;
}

/// A number; not written where it is 0.
ValueType<double> number_if_any() {
  ValueType<double> type = measured_number();
  type.write = [write = type.write](const double& value) {
    return value == 0.0 ? Json() : write(value);
  };
  return type;
}

template <class T>
Key<T> number_key(const char* name, double T::*member, const char* sentence) {
  return required(key(name, member, measured_number(), sentence));
}

template <class T>
Key<T> text_key(const char* name, std::string T::*member, const char* sentence) {
  return required(key(name, member, text(), sentence));
}

/// An object with some keys of the same T.
template <class T>
Key<T> grouped(const char* name, const Block<T>& block, const char* sentence) {
  return {{.name = name, .form = block.form(), .sentence = sentence},
          [&block](T& into, const Json& value, const DocumentPlace& place) {
            read_keys(block.keys(), value, place, into);
          },
          [&block](const T& from) { return block.write(from); }};
}

/// A key of the times of a point, which may have none.
Key<BenchmarkPoint> time_key(const Key<BenchmarkTimes>& key) {
  KeyForm form = key.form;
  form.usual = nullptr;
  return {std::move(form),
          [read = key.read](BenchmarkPoint& into, const Json& value, const DocumentPlace& place) {
            if (!into.times) into.times.emplace();
            read(*into.times, value, place);
          },
          [write = key.write](const BenchmarkPoint& from) {
            return from.times ? write(*from.times) : Json();
          }};
}

/// A setting has its value under the name of what changes.
Key<BenchmarkPoint> setting_key(const char* name) {
  return {{.name = name, .form = measured_number().form, .sentence = "the setting"},
          [name](BenchmarkPoint& into, const Json& value, const DocumentPlace&) {
            into.parameter = name;
            into.value = value.get<double>();
          },
          [name](const BenchmarkPoint& from) {
            return from.parameter == name ? measured_number().write(from.value) : Json();
          }};
}

/// A setting, or of a method with another setting.
Key<BenchmarkPoint> step_key() {
  Key<BenchmarkPoint> key = setting_key("step_s");
  key.form.sentence = "of the method";
  key.read = [set = key.read](BenchmarkPoint& into, const Json& value, const DocumentPlace& place) {
    if (into.parameter.empty()) set(into, value, place);
    into.step_s = value.get<double>();
  };
  key.write = [setting = key.write](const BenchmarkPoint& from) {
    return from.step_s ? measured_number().write(*from.step_s) : setting(from);
  };
  return key;
}

/// The same key, written where a condition holds.
template <class T, class Holds>
Key<T> written_if(Key<T> key, Holds holds) {
  key.form.usual = nullptr;
  key.write = [write = key.write, holds](const T& from) {
    return holds(from) ? write(from) : Json();
  };
  return key;
}

Key<BenchmarkPoint> count_key(const char* name, long MethodWork::*of, const char* sentence) {
  return required(
      within(&BenchmarkPoint::work, key(name, of, whole<long>(0.0, kMostCounted), sentence)));
}

const Block<BenchmarkClaims>& claims_block() {
  using C = BenchmarkClaims;
  static const Block<C> block(
      "claimed", "what a method claimed of its error",
      {number_key("largest_error", &C::largest, "claimed"),
       number_key("median_over_true", &C::median, "claimed over true error"),
       number_key("share_covered", &C::covered, "of instants")});
  return block;
}

const Block<BenchmarkTimes>& wall_block() {
  using T = BenchmarkTimes;
  static const Block<T> block("wall", "wall time of a run",
                              {number_key("median", &T::median_s, "s"),
                               number_key("lower_quartile", &T::lower_quartile_s, "s"),
                               number_key("upper_quartile", &T::upper_quartile_s, "s"),
                               number_key("least", &T::least_s, "s")});
  return block;
}

const Block<BenchmarkStepTimes>& step_wall_block() {
  using T = BenchmarkStepTimes;
  static const Block<T> block(
      "step_wall", "wall time of a step",
      {number_key("median", &T::median_s, "s"), number_key("p99", &T::p99_s, "s"),
       number_key("largest", &T::largest_s, "s")});
  return block;
}

const Block<BenchmarkPoint>& point_block() {
  using P = BenchmarkPoint;
  using T = BenchmarkTimes;
  const auto with_error = [](const P& p) { return std::isfinite(p.error); };
  const auto timed = [](const P& p) { return p.times.has_value(); };
  static const Block<P> block(
      "point", "a method at a setting",
      {text_key("method", &P::method, "its name"),
       key("variant", &P::variant, text_if_any(), "of the method"),
       setting_key("tolerance"),
       setting_key("relaxation_time_s"),
       step_key(),
       text_key("end", &P::end, "how the run ended"),
       key("reason", &P::reason, text_if_any(), "why it ended early"),
       key("error", &P::error, measured_number(), "against the reference"),
       written_if(key("below_floor", &P::below_floor, flag(), "the reference is no better"),
                  with_error),
       required(key("end_time_s", &P::end_time_s, measured_number(kAnyNumber), "that was reached")),
       count_key("steps", &MethodWork::steps, "taken"),
       count_key("rates", &MethodWork::rates, "evaluations"),
       count_key("factorisations", &MethodWork::factorisations, "of matrices"),
       count_key("solves", &MethodWork::solves, "of linear systems"),
       key("claims", &P::claims, claims_block().type(), "of its own error"),
       time_key(key("repeats", &T::repeats, whole<int>(1, 1e6), "measurements")),
       time_key(
           key("runs_per_repeat", &T::runs_per_repeat, whole<long>(1, kMostCounted), "in each")),
       time_key(grouped("wall_s", wall_block(), "wall time of a run")),
       key("step_wall_s", &P::step_times, step_wall_block().type(), "wall time of a step"),
       written_if(key("build_s", &P::build_s, number_if_any(), "before the first step"), timed)});
  return block;
}

const Block<BenchmarkTarget>& target_block() {
  using T = BenchmarkTarget;
  static const Block<T> block(
      "target", "a point of a curve",
      {text_key("curve", &T::curve, "which"), number_key("error", &T::error, "of it"),
       number_key("step_median_s", &T::step_median_s, "wall time"),
       key("step_p99_s", &T::step_p99_s, number_if_any(), "wall time"),
       key("build_s", &T::build_s, number_if_any(), "before the first step")});
  return block;
}

const Block<BenchmarkResult>& reference_block() {
  using R = BenchmarkReference;
  const auto of = [](const Key<R>& key) {
    return required(within(&BenchmarkResult::reference, key));
  };
  const auto answer = [&](const char* name, BenchmarkAnswer R::*which,
                          std::string BenchmarkAnswer::*member, const char* sentence) {
    return of(within(which, text_key(name, member, sentence)));
  };
  static const Block<BenchmarkResult> block(
      "benchmark_reference", "what errors are relative to",
      {answer("first", &R::first, &BenchmarkAnswer::words, "in words"),
       answer("first_method", &R::first, &BenchmarkAnswer::method, "of the first"),
       answer("second", &R::second, &BenchmarkAnswer::words, "in words"),
       answer("second_method", &R::second, &BenchmarkAnswer::method, "of the second"),
       of(key("exact", &R::exact, flag(), "a closed form")),
       of(number_key("peak", &R::peak, "of the response")),
       text_key("peak_unit", &BenchmarkResult::unit, "its unit"),
       of(number_key("agreement", &R::agreement, "of the two")),
       of(number_key("floor", &R::floor, "below which errors say nothing"))});
  return block;
}

const Block<BenchmarkResult>& result_block() {
  using R = BenchmarkResult;
  static const Block<R> block(
      "problem", "a named problem",
      {required(
           key("name", &R::name,
               text_like("^[a-z0-9_]+$", "a name of small letters, digits and _", "bond_paper"),
               "of the problem")),
       text_key("title", &R::title, "in a line"), text_key("text", &R::text, "in words"),
       text_key("response", &R::response, "what is compared"),
       number_key("simulated_s", &R::simulated_s, "time"),
       key("relaxation_time_s", &R::relaxation_time_s, number_if_any(), "of the tissue"),
       written_if(key("targets", &R::targets, list(target_block().type()), "other points"),
                  [](const R& r) { return !r.targets.empty(); }),
       required(grouped("reference", reference_block(), "what errors are relative to")),
       required(key("points", &R::points, list(point_block().type()), "methods at their settings")),
       unread<R>("run", map_form(any("").form), "when and where it was measured")});
  return block;
}

std::size_t place_in_list(std::string_view name) {
  const auto entries = benchmark_entries();
  const auto at = std::ranges::find(entries, name, &BenchmarkEntry::name);
  return static_cast<std::size_t>(at - entries.begin());
}

std::string options_words(const BenchmarkOptions& options) {
  return options.timing ? fmt::format("--repetitions {}", options.repeats) : "--no-timing";
}

/// Of a document that the schema has let pass.
BenchmarkRecord read_record(const Json& json) {
  BenchmarkRecord record;
  record.options.timing = json.at("timing").get<bool>();
  if (record.options.timing) record.options.repeats = json.at("repeats").get<int>();
  for (const Json& problem : json.at("problems")) {
    record.results.push_back(result_block().made(problem, DocumentPlace{"problems"}));
    if (problem.contains("run")) record.runs[record.results.back().name] = problem.at("run");
  }
  return record;
}

/// Reads what to_json wrote, for a run that goes on from it: of references only words and numbers
/// are there, not their responses.
/// Throws Error(input) with the place in the file where it is not what to_json writes.
BenchmarkRecord read_benchmark(const std::filesystem::path& file) {
  return read_record(checked(read_json(file), benchmark_kind(), file.string()));
}

}  // namespace

const FileKind& benchmark_kind() {
  static const FileKind kind{
      "benchmark", "What tpm accuracy benchmark measured",
      "Written by tpm accuracy benchmark, read by --keep",
      object_form(
          "benchmark", "",
          {required_key("timing", flag().form, "times were measured"),
           optional_key("repeats", whole<int>(1, 1e6).form, "measurements of each run"),
           required_key("problems", list_form(result_block().form(), 0), "in their order")})};
  return kind;
}

Json to_json(const BenchmarkRecord& record) {
  Json json{{"timing", record.options.timing}};
  if (record.options.timing) json["repeats"] = record.options.repeats;
  json["problems"] = array_json(record.results, [&](const BenchmarkResult& result) {
    Json problem = result_block().write(result);
    const auto run = record.runs.find(result.name);
    if (run != record.runs.end()) problem["run"] = run->second;
    return problem;
  });
  return json;
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
  const auto at = std::ranges::find_if(record.results, [&](const BenchmarkResult& other) {
    return place_in_list(other.name) >= place_in_list(result.name);
  });
  if (at != record.results.end() && at->name == result.name) {
    *at = std::move(result);
  } else {
    record.results.insert(at, std::move(result));
  }
}

}  // namespace tpm::accuracy
