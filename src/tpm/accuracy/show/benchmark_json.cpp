// Declared in tpm/accuracy/show/benchmark_report.hpp.
// The record of tpm accuracy benchmark as JSON, both ways, and what an earlier run has left.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "tpm/accuracy/show/benchmark_report.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/json.hpp"
#include "tpm/files/keys/more_types.hpp"
#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

constexpr int kBenchmarkDigits = 5;

/// What a setting's value can be, by its key.
constexpr std::array<const char*, 3> kParameters{"relaxation_time_s", "tolerance", "step_s"};

/// Led over the fields of a record, writes them into an object or, if that is constant, reads them
/// from one that the schema has let pass.
template <class Object>
class RecordFields {
  static constexpr bool kReads = std::is_const_v<Object>;

 public:
  explicit RecordFields(Object& json) : json_(json) {}

  /// True if a field is there: by the file, or as it is to be written.
  bool known(const char* key, bool to_write) const {
    return kReads ? json_.contains(key) : to_write;
  }
  template <class Value>
  void field(const char* key, Value& value) {
    if constexpr (kReads) {
      json_.at(key).get_to(value);
    } else if constexpr (std::is_same_v<Value, const double>) {
      json_[key] = rounded(value, kBenchmarkDigits);
    } else {
      json_[key] = value;
    }
  }
  /// Left out where it is empty or 0.
  template <class Value>
  void optional_field(const char* key, Value& value) {
    if (known(key, value != std::remove_const_t<Value>{})) field(key, value);
  }
  /// True if there is such a part; what is read is made.
  template <class Part>
  bool has(const char* key, Part& part) {
    const bool there = known(key, part.has_value());
    if constexpr (kReads) {
      if (there) part.emplace();
    }
    return there;
  }
  template <class Value, class Fields>
  void object(const char* key, Value& value, const Fields& fields) {
    RecordFields inner(json_[key]);
    fields(inner, value);
  }
  template <class Items, class Fields>
  void list(const char* key, Items& items, const Fields& fields) {
    if constexpr (kReads) {
      items.resize(json_.at(key).size());
    } else {
      json_[key] = Json(items.size(), nullptr);
    }
    for (std::size_t i = 0; i < items.size(); ++i) {
      RecordFields inner(json_[key][i]);
      fields(inner, items[i]);
    }
  }
  /// A setting has its value under the name of what changes.
  template <class Text, class Value>
  void parameter(Text& name, Value& value) {
    if constexpr (kReads) {
      const auto found = std::find_if(kParameters.begin(), kParameters.end(),
                                      [&](const char* key) { return json_.contains(key); });
      if (found != kParameters.end()) name = *found;
    }
    if (!name.empty()) field(name.c_str(), value);
  }
  /// NaN where there is none; whether there is one.
  template <class Value>
  bool finite_field(const char* key, Value& value) {
    const bool there = known(key, std::isfinite(value));
    if (there) {
      field(key, value);
    } else if constexpr (kReads) {
      value = std::numeric_limits<double>::quiet_NaN();
    }
    return there;
  }

 private:
  Object& json_;
};

// The fields of the file in their order, each said once for both ways.

constexpr auto kClaimFields = [](auto& in, auto& claims) {
  in.field("largest_error", claims.largest);
  in.field("median_over_true", claims.median);
  in.field("share_covered", claims.covered);
};

constexpr auto kWallFields = [](auto& in, auto& times) {
  in.field("median", times.median_s);
  in.field("lower_quartile", times.lower_quartile_s);
  in.field("upper_quartile", times.upper_quartile_s);
  in.field("least", times.least_s);
};

constexpr auto kStepWallFields = [](auto& in, auto& times) {
  in.field("median", times.median_s);
  in.field("p99", times.p99_s);
  in.field("largest", times.largest_s);
};

constexpr auto kPointFields = [](auto& in, auto& point) {
  in.field("method", point.method);
  in.optional_field("variant", point.variant);
  in.parameter(point.parameter, point.value);
  if (in.has("step_s", point.step_s)) in.field("step_s", *point.step_s);
  in.field("end", point.end);
  in.optional_field("reason", point.reason);
  if (in.finite_field("error", point.error)) in.field("below_floor", point.below_floor);
  in.field("end_time_s", point.end_time_s);
  in.field("steps", point.work.steps);
  in.field("rates", point.work.rates);
  in.field("factorisations", point.work.factorisations);
  in.field("solves", point.work.solves);
  if (in.has("claims", point.claims)) in.object("claims", *point.claims, kClaimFields);
  if (!in.has("wall_s", point.times)) return;
  in.field("repeats", point.times->repeats);
  in.field("runs_per_repeat", point.times->runs_per_repeat);
  in.object("wall_s", *point.times, kWallFields);
  if (in.has("step_wall_s", point.step_times)) {
    in.object("step_wall_s", *point.step_times, kStepWallFields);
  }
  in.optional_field("build_s", point.build_s);
};

constexpr auto kTargetFields = [](auto& in, auto& target) {
  in.field("curve", target.curve);
  in.field("error", target.error);
  in.field("step_median_s", target.step_median_s);
  in.optional_field("step_p99_s", target.step_p99_s);
  in.optional_field("build_s", target.build_s);
};

constexpr auto kReferenceFields = [](auto& in, auto& result) {
  in.field("first", result.reference.first.words);
  in.field("first_method", result.reference.first.method);
  in.field("second", result.reference.second.words);
  in.field("second_method", result.reference.second.method);
  in.field("exact", result.reference.exact);
  in.field("peak", result.reference.peak);
  in.field("peak_unit", result.unit);
  in.field("agreement", result.reference.agreement);
  in.field("floor", result.reference.floor);
};

constexpr auto kResultFields = [](auto& in, auto& result) {
  in.field("name", result.name);
  in.field("title", result.title);
  in.field("text", result.text);
  in.field("response", result.response);
  in.field("simulated_s", result.simulated_s);
  in.optional_field("relaxation_time_s", result.relaxation_time_s);
  if (in.known("targets", !result.targets.empty()))
    in.list("targets", result.targets, kTargetFields);
  in.object("reference", result, kReferenceFields);
  in.list("points", result.points, kPointFields);
};

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
    RecordFields reader(problem);
    kResultFields(reader, record.results.emplace_back());
    if (problem.contains("run")) record.runs[record.results.back().name] = problem.at("run");
  }
  return record;
}

FormPtr positive_form() {
  return number(kZeroOrMore).form;
}

FormPtr counted_form(double least = 0.0) {
  return whole<std::int64_t>(least, 9007199254740991.0).form;
}

KeyForm number_key(const char* name, const char* sentence) {
  return required_key(name, positive_form(), sentence);
}

KeyForm maybe_number_key(const char* name, const char* sentence) {
  return optional_key(name, positive_form(), sentence);
}

KeyForm text_key(const char* name, const char* sentence) {
  return required_key(name, text().form, sentence);
}

FormPtr point_form() {
  const FormPtr claims = object_form("claimed", "what a method claimed of its error",
                                     {number_key("largest_error", "claimed"),
                                      number_key("median_over_true", "claimed over true error"),
                                      number_key("share_covered", "of instants")});
  const FormPtr wall = object_form("wall", "wall time of a run",
                                   {number_key("median", "s"), number_key("lower_quartile", "s"),
                                    number_key("upper_quartile", "s"), number_key("least", "s")});
  const FormPtr step_wall =
      object_form("step_wall", "wall time of a step",
                  {number_key("median", "s"), number_key("p99", "s"), number_key("largest", "s")});
  return object_form("point", "a method at a setting",
                     {text_key("method", "its name"),
                      optional_key("variant", text().form, "of the method"),
                      maybe_number_key("step_s", "of the method"),
                      maybe_number_key("tolerance", "the setting"),
                      maybe_number_key("relaxation_time_s", "the setting"),
                      text_key("end", "how the run ended"),
                      optional_key("reason", text().form, "why it ended early"),
                      maybe_number_key("error", "against the reference"),
                      optional_key("below_floor", flag().form, "the reference is no better"),
                      required_key("end_time_s", number().form, "that was reached"),
                      required_key("steps", counted_form(), "taken"),
                      required_key("rates", counted_form(), "evaluations"),
                      required_key("factorisations", counted_form(), "of matrices"),
                      required_key("solves", counted_form(), "of linear systems"),
                      optional_key("claims", claims, "of its own error"),
                      optional_key("repeats", whole<int>(1, 1e6).form, "measurements"),
                      optional_key("runs_per_repeat", counted_form(1), "in each"),
                      optional_key("wall_s", wall, "wall time of a run"),
                      optional_key("step_wall_s", step_wall, "wall time of a step"),
                      maybe_number_key("build_s", "before the first step")});
}

FormPtr problem_form() {
  const FormPtr target = object_form(
      "target", "a point of a curve",
      {text_key("curve", "which"), number_key("error", "of it"),
       number_key("step_median_s", "wall time"), maybe_number_key("step_p99_s", "wall time"),
       maybe_number_key("build_s", "before the first step")});
  const FormPtr reference = object_form(
      "benchmark_reference", "what errors are relative to",
      {text_key("first", "in words"), text_key("first_method", "of the first"),
       text_key("second", "in words"), text_key("second_method", "of the second"),
       required_key("exact", flag().form, "a closed form"), number_key("peak", "of the response"),
       text_key("peak_unit", "its unit"), number_key("agreement", "of the two"),
       number_key("floor", "below which errors say nothing")});
  return object_form(
      "problem", "a named problem",
      {required_key(
           "name",
           text_like("^[a-z0-9_]+$", "a name of small letters, digits and _", "bond_paper").form,
           "of the problem"),
       text_key("title", "in a line"), text_key("text", "in words"),
       text_key("response", "what is compared"), number_key("simulated_s", "time"),
       maybe_number_key("relaxation_time_s", "of the tissue"),
       optional_key("targets", list_form(target, 0), "other points"),
       required_key("reference", reference, "what errors are relative to"),
       required_key("points", list_form(point_form(), 0), "methods at their settings"),
       optional_key("run", map_form(any("").form), "when and where it was measured")});
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
      object_form("benchmark", "",
                  {required_key("timing", flag().form, "times were measured"),
                   optional_key("repeats", whole<int>(1, 1e6).form, "measurements of each run"),
                   required_key("problems", list_form(problem_form(), 0), "in their order")})};
  return kind;
}

Json to_json(const BenchmarkRecord& record) {
  Json json{{"timing", record.options.timing}};
  if (record.options.timing) json["repeats"] = record.options.repeats;
  json["problems"] = array_json(record.results, [&](const BenchmarkResult& result) {
    Json problem;
    RecordFields writer(problem);
    kResultFields(writer, result);
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
