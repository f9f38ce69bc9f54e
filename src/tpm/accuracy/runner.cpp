#include "tpm/accuracy/runner.hpp"

#include "tpm/base/enum_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "tpmkit/error.hpp"

namespace tpm::accuracy {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// An error of the whole peak is no answer.
constexpr double kUselessError = 1.0;

/// @param claimed, true_error at each time, in parts of the peak
/// @param floor a true error below cannot be told
/// @returns none if no error can be told
std::optional<BenchmarkClaims> claims_of(const Eigen::VectorXd& claimed,
                                         const Eigen::VectorXd& true_error, double floor) {
  std::vector<double> ratios;
  for (Eigen::Index i = 0; i < claimed.size(); ++i) {
    if (true_error[i] > floor) ratios.push_back(claimed[i] / true_error[i]);
  }
  if (ratios.empty()) return std::nullopt;
  BenchmarkClaims claims;
  claims.largest = claimed.maxCoeff();
  std::sort(ratios.begin(), ratios.end());
  claims.median = quantile_of_sorted(ratios, 0.5);
  const auto short_of = std::lower_bound(ratios.begin(), ratios.end(), 1.0) - ratios.begin();
  claims.covered = 1.0 - static_cast<double>(short_of) / static_cast<double>(ratios.size());
  return claims;
}

void compare(BenchmarkPoint& point, const BenchmarkRun& whole_run, const BenchmarkSetting& setting,
             const BenchmarkReference& reference) {
  const MethodRun& run = whole_run.outcome;
  point.end = benchmark_end_word(run.end);
  point.reason = run.reason;
  point.end_time_s = run.end_time_s;
  point.work = run.work;
  point.error = std::numeric_limits<double>::quiet_NaN();
  if (run.end != MethodEnd::completed) return;
  const Eigen::VectorXd& whole = reference.response_for(point.method);
  const AnsweredPart part = setting.part ? setting.part() : AnsweredPart{0, whole.size()};
  const auto expected = whole.segment(part.first, part.count);
  if (run.response.size() != expected.size() || !run.response.allFinite()) {
    throw Error(ExitCode::numerical, point.curve(),
                "a run that says it completed has not answered at every time");
  }
  const Eigen::VectorXd errors =
      sizes_of(run.response - expected, reference.components) / reference.peak;
  const double error = errors.maxCoeff();
  const double floor = setting.part ? reference.floor_of(part) : reference.floor;
  if (whole_run.claimed.size() > 0) {
    point.claims = claims_of(whole_run.claimed / reference.peak, errors, floor);
  }
  point.below_floor = error <= floor;
  point.error = std::max(error, floor);
  if (error <= kUselessError) return;
  point.end = "error_above_peak";
  point.reason = fmt::format("ran to the end with an error of {:.2g} times the peak", error);
}

BenchmarkTimes quartiles(std::vector<double> taken, long runs_per_repeat) {
  std::sort(taken.begin(), taken.end());
  return {static_cast<int>(taken.size()),  runs_per_repeat,
          quantile_of_sorted(taken, 0.5),  quantile_of_sorted(taken, 0.25),
          quantile_of_sorted(taken, 0.75), taken.front()};
}

/// @param once_s what the run took when it was made to be compared
void time_runs(const BenchmarkSetting& setting, double once_s, const BenchmarkOptions& options,
               BenchmarkPoint& point) {
  if (point.failed()) {
    point.times = quartiles({once_s}, 1);
    return;
  }
  const long runs = std::max(1L, std::lround(std::ceil(options.least_repeat_s / once_s)));
  std::vector<double> taken;
  std::vector<std::vector<double>> of_step;
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    const auto start = Clock::now();
    for (long i = 0; i < runs; ++i) {
      const BenchmarkRun run = setting.run(true);
      of_step.resize(run.step_wall_s.size());
      for (std::size_t k = 0; k < of_step.size(); ++k) of_step[k].push_back(run.step_wall_s[k]);
    }
    taken.push_back(seconds_since(start) / static_cast<double>(runs));
  }
  point.times = quartiles(std::move(taken), runs);
  if (of_step.empty()) return;
  std::vector<double> steps;
  for (std::vector<double>& times : of_step) {
    std::sort(times.begin(), times.end());
    steps.push_back(quantile_of_sorted(times, 0.5));
  }
  std::sort(steps.begin(), steps.end());
  point.step_times = {quantile_of_sorted(steps, 0.5), quantile_of_sorted(steps, 0.99),
                      steps.back()};
}

BenchmarkPoint point_of(const BenchmarkSetting& setting, const BenchmarkReference& reference,
                        const BenchmarkOptions& options) {
  BenchmarkPoint point;
  point.method = setting.method;
  point.variant = setting.variant;
  point.parameter = setting.parameter;
  point.value = setting.value;
  point.step_s = setting.step_s;
  const auto start = Clock::now();
  const BenchmarkRun run = setting.run(false);
  const double once_s = seconds_since(start);
  point.build_s = run.build_s;
  compare(point, run, setting, reference);
  if (options.timing) time_runs(setting, once_s, options, point);
  return point;
}

}  // namespace

double quantile_of_sorted(std::span<const double> values, double share) {
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

std::string_view benchmark_end_word(MethodEnd end) {
  static constexpr auto kNames = std::to_array<Word<MethodEnd>>({
      {MethodEnd::completed, "completed"},
      {MethodEnd::diverged, "diverged"},
      {MethodEnd::newton_failed, "newton_failed"},
      {MethodEnd::buckled, "buckled"},
      {MethodEnd::too_much_work, "too_much_work"},
      {MethodEnd::not_applicable, "not_applicable"},
  });
  const std::string_view word = word_for(kNames, end);
  if (!word.empty()) return word;
  throw Error(ExitCode::numerical, "benchmark", "an end that has no word");
}

BenchmarkResult run_benchmark(const BenchmarkProblem& problem, const BenchmarkOptions& options,
                              const std::function<void()>& progress) {
  BenchmarkResult result{problem.name,
                         problem.title,
                         problem.text,
                         problem.response,
                         problem.unit,
                         problem.simulated_s,
                         problem.relaxation_time_s,
                         problem.reference(),
                         problem.targets,
                         {}};
  for (const BenchmarkSetting& setting : problem.settings) {
    result.points.push_back(point_of(setting, result.reference, options));
    if (progress) progress();
  }
  return result;
}

}  // namespace tpm::accuracy
