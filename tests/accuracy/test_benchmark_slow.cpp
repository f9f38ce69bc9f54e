// tpm accuracy benchmark: errors against the test's own arithmetic, references that disagree,
// failures.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/accuracy/element_problems.hpp"
#include "tpm/accuracy/runner.hpp"
#include "tpm/accuracy/servo_problems.hpp"
#include "tpm/accuracy/show/benchmark_report.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"

using namespace tpm;
using namespace tpm::accuracy;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;

namespace {

constexpr double kDepth_m = 8e-3, kRate_m_per_s = 4e-3, kHoldFrom_s = 2.0, kEnd_s = 31.0;

BenchmarkOptions counts_only() {
  BenchmarkOptions options;
  options.timing = false;
  return options;
}

/// The paper's element under the ramp and hold, its force split into what depends on depth alone
/// and what relaxes: F = scale (E2 e + lambda1(e) e - g w), dw/dt = (e - w)/tau.
struct Element {
  explicit Element(double eta1_Pa_s) : tau_s(eta1_Pa_s / 24e3) {}
  [[nodiscard]] static double depth(double time_s) {
    return time_s < kHoldFrom_s ? kRate_m_per_s * time_s : kDepth_m;
  }
  /// w in closed form (docs/theory.md).
  [[nodiscard]] double viscous(double time_s) const {
    const auto ramp = [&](double t) {
      return kRate_m_per_s * (t + tau_s * std::expm1(-t / tau_s));
    };
    if (time_s <= kHoldFrom_s) return ramp(time_s);
    return kDepth_m + (ramp(kHoldFrom_s) - kDepth_m) * std::exp(-(time_s - kHoldFrom_s) / tau_s);
  }
  [[nodiscard]] static double force(double e, double w) {
    const double lambda1 = 2.0 * 12e3 * (1.0 - std::cos(std::atan(e / 0.030)));
    return 12.56e-3 * (12e3 * e + lambda1 * e - 6e3 * w);
  }
  double tau_s;
};

/// The largest error over every half second of an Euler rule, over the largest force.
double euler_error(const Element& element, double step_s, bool implicit) {
  const auto steps = std::lround(kEnd_s / step_s);
  const auto every = std::lround(0.5 / step_s);
  const double ratio = step_s / element.tau_s;
  double w = 0.0, error = 0.0, peak = 0.0;
  for (long i = 0; i <= steps; ++i) {
    const double t = step_s * static_cast<double>(i);
    const double e = Element::depth(t);
    if (i > 0 && implicit) w = (w + ratio * e) / (1.0 + ratio);
    if (i > 0 && !implicit) w += ratio * (Element::depth(t - step_s) - w);
    if (i % every != 0) continue;
    const double exact = Element::force(e, element.viscous(t));
    error = std::max(error, std::abs(Element::force(e, w) - exact));
    peak = std::max(peak, std::abs(exact));
  }
  return error / peak;
}

const BenchmarkPoint& point_of(const BenchmarkResult& result, const std::string& curve,
                               double value) {
  for (const BenchmarkPoint& p : result.points) {
    if (p.curve() == curve && p.value == value) return p;
  }
  FAIL("no point of " << curve);
  return result.points.front();
}

BenchmarkSetting answering(std::string method, MethodRun run) {
  return {std::move(method), "", "step_s", 1e-3, 1e-3, [run](bool time_steps) -> BenchmarkRun {
            if (!time_steps) return {run, {}};
            return {run, {3e-6, 1e-6, 2e-6, 4e-6, 5e-6}};
          }};
}

MethodRun answer(double first, double second) {
  MethodRun run;
  run.response = Eigen::Vector2d(first, second);
  run.end_time_s = 2.0;
  run.work.steps = 5;
  return run;
}

/// A problem whose answer is (1, 2), known to 1e-5.
BenchmarkProblem made_up() {
  BenchmarkProblem problem;
  problem.name = "made_up";
  problem.response = "contact force";
  problem.simulated_s = 2.0;
  problem.reference = [] {
    return checked_reference({"a", "one way", Eigen::Vector2d(1.0, 2.0)},
                             {"b", "another way", Eigen::Vector2d(1.0, 2.0 + 2e-6)}, false, 1e-4,
                             "made_up");
  };
  return problem;
}

}  // namespace

TEST_CASE("errors of a benchmark are those that the test computes for itself") {
  const BenchmarkResult result = run_benchmark(bond_fitted_problem(), counts_only());
  const Element element(kFittedEta1_Pa_s);
  for (const double step_s : {0.1, 0.05}) {
    CAPTURE(step_s);
    CHECK_THAT(point_of(result, "forward_euler", step_s).error,
               WithinRel(euler_error(element, step_s, false), 1e-5));
    CHECK_THAT(point_of(result, "backward_euler", step_s).error,
               WithinRel(euler_error(element, step_s, true), 1e-5));
  }
  CHECK_THAT(result.reference.peak,
             WithinRel(Element::force(kDepth_m, element.viscous(kHoldFrom_s)), 1e-12));
}

TEST_CASE("every rule stands in the CSV, and what failed with its reason") {
  const BenchmarkResult result = run_benchmark(bond_paper_problem(), counts_only());
  const std::string csv = benchmark_csv(result, false);
  std::set<std::string> methods;
  for (const BenchmarkPoint& p : result.points) {
    methods.insert(p.method);
    CHECK(p.failed() == !p.reason.empty());
    CHECK(p.failed() == !(p.error <= 1.0));
  }
  for (const StepRuleEntry& rule : kStepRules) {
    CAPTURE(rule.text);
    CHECK(methods.contains(std::string(rule.text)));
    CHECK(csv.find(std::string(rule.text)) != std::string::npos);
  }
  CHECK(methods.contains("collocation"));
  CHECK(methods.contains("closed_form"));
  // Two relaxation times are 0.417 ms: the explicit rule fails above and holds below.
  CHECK(point_of(result, "forward_euler", 5e-4).end == "diverged");
  CHECK(point_of(result, "forward_euler", 1e-3).end == "diverged");
  CHECK(point_of(result, "forward_euler", 4e-4).end == "completed");
  CHECK(point_of(result, "inertial", 0.0).end == "not_applicable");
  CHECK(csv.find("wall") == std::string::npos);
  CHECK(csv == benchmark_csv(run_benchmark(bond_paper_problem(), counts_only()), false));
}

TEST_CASE("figures show every setting once, failures included") {
  BenchmarkRecord record;
  record.options.repeats = 1;
  record.options.least_repeat_s = 0.0;
  record.results.push_back(run_benchmark(bond_fitted_problem(), record.options));
  const std::vector<Figure> figures = benchmark_figures(record);
  REQUIRE(figures.size() == 2);
  std::size_t drawn = 0, named = 0;
  for (const Series& s : figures.front().panels.front().series) {
    if (s.kind == Series::Kind::trail || s.kind == Series::Kind::failed) drawn += s.x.size();
    if (s.kind == Series::Kind::failed && s.text == "not applicable") named += 1;
  }
  std::size_t placed = 0, not_applicable = 0;
  for (const BenchmarkPoint& p : record.results.front().points) {
    (p.end == "not_applicable" ? not_applicable : placed) += 1;
  }
  CHECK(drawn == placed);
  CHECK((named > 0) == (not_applicable > 0));
  CHECK_NOTHROW(to_json(figures));
}

TEST_CASE("a reference that its second does not confirm is refused") {
  const Eigen::Vector3d right(0.0, 1.0, 0.5);
  const auto check = [&](const Eigen::VectorXd& second, const std::string& method) {
    return checked_reference({"a", "one way", right}, {method, "another way", second}, false, 1e-6,
                             "liver");
  };
  const BenchmarkReference good = check(right * (1.0 + 5e-8), "b");
  CHECK_THAT(good.agreement, WithinRel(5e-8, 1e-6));
  CHECK_THAT(good.floor, WithinRel(5e-7, 1e-6));
  CHECK(good.response_for("a") == good.second.response);
  CHECK(good.response_for("c") == good.first.response);
  CHECK_THAT(test::refusal_of([&] { (void)check(right * (1.0 + 2e-7), "b"); }),
             Contains("reference of liver") && Contains("differ by 2e-07 of the peak"));
  CHECK_THAT(test::refusal_of([&] { (void)check(right, "a"); }), Contains("both answers"));
  CHECK_THAT(test::refusal_of([&] { (void)check(right.head(2), "b"); }), Contains("missing"));
  Eigen::Vector3d unfinished = right;
  unfinished[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(test::refusal_of([&] { (void)check(unfinished, "b"); }), Contains("not finite"));
}

TEST_CASE("how a run ended decides what becomes of it") {
  BenchmarkProblem problem = made_up();
  problem.settings.push_back(answering("near", answer(1.0, 2.002)));
  problem.settings.push_back(answering("nearer", answer(1.0, 2.0 + 1e-9)));
  problem.settings.push_back(answering("far", answer(1.0, 4.5)));
  MethodRun failed = answer(1.0, std::numeric_limits<double>::quiet_NaN());
  failed.end = MethodEnd::diverged;
  failed.reason = "went away";
  problem.settings.push_back(answering("gone", failed));
  problem.settings.push_back(answering("a", answer(1.0, 2.0)));
  BenchmarkOptions options;
  options.repeats = 7;
  const BenchmarkResult result = run_benchmark(problem, options);
  REQUIRE(result.points.size() == 5);
  CHECK_THAT(result.points[0].error, WithinRel(1e-3, 1e-9));
  CHECK(result.points[1].below_floor);
  CHECK_THAT(result.points[1].error, WithinRel(1e-5, 1e-6));
  CHECK(result.points[2].end == "error_above_peak");
  CHECK(result.points[3].end == "diverged");
  CHECK(result.points[3].reason == "went away");
  CHECK(result.points[0].times.value().repeats == 7);
  CHECK(result.points[3].times.value().repeats == 1);
  // The first answer's own method is compared with the second answer.
  CHECK_THAT(result.points[4].error, WithinRel(1e-5, 1e-6));
  CHECK(result.points[4].below_floor);
  const BenchmarkStepTimes steps = result.points[0].step_times.value();
  CHECK_THAT(steps.median_s, WithinRel(3e-6, 1e-12));
  CHECK_THAT(steps.largest_s, WithinRel(5e-6, 1e-12));

  MethodRun liar = answer(1.0, std::numeric_limits<double>::quiet_NaN());
  problem.settings = {answering("liar", liar)};
  CHECK_THAT(test::refusal_of([&] { (void)run_benchmark(problem, options); }),
             Contains("liar") && Contains("has not answered"));
}

TEST_CASE("a setting may answer a part of the response, in vectors, and claim an error") {
  BenchmarkProblem problem;
  problem.name = "made_up";
  problem.reference = [] {
    const Eigen::VectorXd right = (Eigen::VectorXd(6) << 3.0, 4.0, 0.0, 5.0, 5.0, 0.0).finished();
    return checked_reference({"a", "one way", right}, {"b", "another way", right * (1.0 + 1e-7)},
                             false, 1e-4, "made_up", 2);
  };
  BenchmarkSetting setting;
  setting.method = "m";
  setting.part = [] { return AnsweredPart{2, 4}; };
  setting.run = [](bool time_steps) {
    BenchmarkRun run;
    run.outcome.response = Eigen::Vector4d(0.3, 5.4, 5.0, 0.1);  // off by 0.5 and 0.1
    run.outcome.end_time_s = 1.0;
    run.claimed = Eigen::Vector2d(1.0, 0.05);
    run.build_s = 7.0;
    if (time_steps) run.step_wall_s = {2e-6, 8e-6};
    return run;
  };
  problem.settings = {setting};
  BenchmarkOptions options;
  options.repeats = 3;
  const BenchmarkPoint point = run_benchmark(problem, options).points.front();
  constexpr double peak = 5.0;
  CHECK_THAT(point.error, WithinRel(0.5 / peak, 1e-12));
  const BenchmarkClaims claims = point.claims.value();
  CHECK_THAT(claims.largest, WithinRel(1.0 / peak, 1e-12));
  CHECK_THAT(claims.median, WithinRel(0.5 * (2.0 + 0.5), 1e-9));
  CHECK(claims.covered == 0.5);
  CHECK(point.build_s == 7.0);
  CHECK_THAT(point.step_times.value().median_s, WithinRel(5e-6, 1e-12));
  CHECK(benchmark_csv({"n", "t", "x", "r", "N", 1.0, 0.0, {}, {}, {point}}, true).find(",7\n") !=
        std::string::npos);
}

TEST_CASE("contact models are asked in servo problems as docs/accuracy.md says") {
  for (const BenchmarkProblem& problem : {servo_normal_problem(), servo_space_problem()}) {
    CAPTURE(problem.name);
    std::set<std::string> curves;
    for (const BenchmarkSetting& setting : problem.settings) {
      curves.insert(setting.curve());
      CHECK(setting.parameter == "relaxation_time_s");
      CHECK(setting.step_s.value() <= 1e-3);
    }
    REQUIRE(problem.targets.size() >= 2);
    for (const BenchmarkTarget& target : problem.targets) CHECK(curves.contains(target.curve));
  }
}

TEST_CASE("quantiles lie between neighbours") {
  const std::vector<double> values{1.0, 2.0, 4.0};
  CHECK(quantile_of_sorted(values, 0.0) == 1.0);
  CHECK(quantile_of_sorted(values, 0.5) == 2.0);
  CHECK(quantile_of_sorted(values, 0.75) == 3.0);
  CHECK(quantile_of_sorted(values, 1.0) == 4.0);
}

TEST_CASE("problems are chosen by name") {
  CHECK(chosen_benchmarks({}).size() == benchmark_entries().size());
  const std::vector<std::string> two{"organ_poke", "bond_paper"};
  REQUIRE(chosen_benchmarks(two).size() == 2);
  CHECK(chosen_benchmarks(two).front().name == "bond_paper");
  CHECK_THAT(
      test::refusal_of([] { (void)chosen_benchmarks(std::vector<std::string>{"organ_pole"}); }),
      Contains("'organ_pole'") && Contains("organ_poke_mass"));
}

TEST_CASE("the cheapest setting within an error") {
  BenchmarkResult result;
  const auto point = [](double error, double wall_s, bool failed) {
    BenchmarkPoint p;
    p.method = "m";
    p.end = failed ? "diverged" : "completed";
    p.error = error;
    p.times = BenchmarkTimes{};
    p.times->median_s = wall_s;
    return p;
  };
  result.points = {point(1e-2, 1.0, false), point(1e-3, 5.0, false), point(1e-3, 3.0, false),
                   point(1e-5, 0.1, true)};
  CHECK(cheapest_within(result, "m", 1e-2) == &result.points[0]);
  CHECK(cheapest_within(result, "m", 2e-3) == &result.points[2]);
  CHECK(cheapest_within(result, "m", 1e-4) == nullptr);
}

TEST_CASE("a run that was interrupted goes on, and writes what a whole one writes") {
  const test::TempFolder folder;
  BenchmarkRecord whole;
  whole.options = counts_only();
  for (const BenchmarkEntry& entry : benchmark_entries()) {
    if (entry.name != "bond_fitted" && entry.name != "star_creep") continue;
    put_result(whole, run_benchmark(entry.make(), whole.options), {});
  }
  BenchmarkRecord begun = whole;
  begun.results.erase(begun.results.begin());
  write_file(folder / kBenchmarkPart, to_text(to_json(begun)));
  KeptBenchmark kept = keep_benchmark(folder.path(), counts_only(), {});
  CHECK(kept.missing.size() == benchmark_entries().size() - 1);
  CHECK(std::none_of(kept.missing.begin(), kept.missing.end(),
                     [](const BenchmarkEntry& entry) { return entry.name == "star_creep"; }));
  put_result(kept.record, whole.results.front(), {});
  CHECK(to_text(to_json(kept.record)) == to_text(to_json(whole)));
  CHECK(benchmark_csv(kept.record.results.back(), false) ==
        benchmark_csv(whole.results.back(), false));

  SECTION("what is named is run anew") {
    const std::vector<std::string> named{"star_creep"};
    kept = keep_benchmark(folder.path(), counts_only(), named);
    REQUIRE(kept.missing.size() == 1);
    CHECK(kept.missing.front().name == "star_creep");
  }
  SECTION("with other options") {
    CHECK_THROWS_WITH(keep_benchmark(folder.path(), BenchmarkOptions{}, {}),
                      Contains("--keep") && Contains("made with --no-timing"));
  }
  SECTION("cut off") {
    const std::string text = to_text(to_json(begun));
    write_file(folder / kBenchmarkPart, text.substr(0, text.size() / 2));
    CHECK_THROWS_WITH(keep_benchmark(folder.path(), counts_only(), {}), Contains(kBenchmarkPart));
  }
  SECTION("a key that is not known") {
    Json json = to_json(begun);
    json["problems"][0]["points"][3]["speed"] = 1.0;
    write_file(folder / kBenchmarkPart, to_text(json));
    CHECK_THROWS_WITH(keep_benchmark(folder.path(), counts_only(), {}),
                      Contains(kBenchmarkPart) && Contains("speed"));
  }
}
