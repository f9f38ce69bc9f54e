#pragma once
#include <functional>
#include <limits>

#include "tpm/accuracy/problem.hpp"

namespace tpm::accuracy {

struct BenchmarkOptions {
  int repeats = 20;              ///< of every run that completes, >= 1
  bool timing = true;            ///< false: every run once and no clock is read
  double least_repeat_s = 1e-3;  ///< shorter runs are repeated within a repeat
};

/// Wall time of a run over the repeats, s.
struct BenchmarkTimes {
  int repeats = 0;
  long runs_per_repeat = 0;
  double median_s = 0.0, lower_quartile_s = 0.0, upper_quartile_s = 0.0, least_s = 0.0;
};

/// Wall time of single steps, s: of each step the median over the repeats, over the steps these.
struct BenchmarkStepTimes {
  double median_s = 0.0, p99_s = 0.0, largest_s = 0.0;
};

/// Errors that a model claimed over those that it had, at each time at which it had one.
struct BenchmarkClaims {
  double median = 0.0;   ///< claimed over true
  double covered = 0.0;  ///< share of the times at which the claim was not less
  double largest = 0.0;  ///< largest claim, in parts of the peak
};

/// A point of a chart, or a failure.
struct BenchmarkPoint {
  std::string method, variant, parameter;
  double value = 0.0;
  std::optional<double> step_s;
  std::string end;     ///< "completed", a word of MethodEnd, or "error_above_peak"
  std::string reason;  ///< in words, where it is no point of a curve
  /// In parts of the peak; NaN unless the run completed.
  double error = std::numeric_limits<double>::quiet_NaN();
  bool below_floor = false;  ///< the error is not larger than this; `error` is the floor
  double end_time_s = 0.0;
  MethodWork work;
  std::optional<BenchmarkTimes> times;
  std::optional<BenchmarkStepTimes> step_times;
  std::optional<BenchmarkClaims> claims;
  double build_s = 0.0;  ///< wall time in which the model was built, once; 0: none

  [[nodiscard]] bool failed() const { return end != "completed"; }
  [[nodiscard]] std::string curve() const {
    return variant.empty() ? method : method + ", " + variant;
  }
};

struct BenchmarkResult {
  std::string name, title, text, response, unit = "N";
  double simulated_s = 0.0, relaxation_time_s = 0.0;
  BenchmarkReference reference;
  std::vector<BenchmarkTarget> targets;
  std::vector<BenchmarkPoint> points;
};

/// The word for how a run ended, in files.
[[nodiscard]] std::string_view benchmark_end_word(MethodEnd end);

/// Runs every setting of a problem. Runs that fail are run once, timed or not: their cost is that
/// of the failure.
/// @param progress if any, called after each setting
/// Throws Error(numerical) if the reference is refused, and what a reference throws.
[[nodiscard]] BenchmarkResult run_benchmark(const BenchmarkProblem& problem,
                                            const BenchmarkOptions& options,
                                            const std::function<void()>& progress = {});

/// Numbers at which a share of the values lies below, between neighbours linearly.
/// @param share 0 to 1
/// @param values not empty, rising
[[nodiscard]] double quantile_of_sorted(std::span<const double> values, double share);

}  // namespace tpm::accuracy
