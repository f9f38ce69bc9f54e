#pragma once
#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/steps/method.hpp"

namespace tpm::accuracy {

/// Result of one run of a setting.
struct BenchmarkRun {
  MethodRun outcome;
  /// Wall time of each step, s, where the problem measures its steps one by one (contact models at
  /// servo rate) and was asked to; else empty.
  /// Where that would be less than reading the clock costs: means of short batches.
  std::vector<double> step_wall_s;
  double build_s = 0.0;  ///< wall time in which the model was built; 0: there is none to build
  Eigen::VectorXd claimed =
      {};  ///< error that the model told for each part of the response, or empty
};

/// The numbers of a response that a setting answers, where it is not all of them.
struct AnsweredPart {
  Eigen::Index first = 0, count = 0;
};

/// One setting of one method: a point of a chart.
struct BenchmarkSetting {
  std::string method;     ///< its word
  std::string variant;    ///< "10 sweeps"; empty for most. Method and variant name a curve
  std::string parameter;  ///< what changes along the curve: "step_s", "tolerance"; empty: nothing
  double value = 0.0;     ///< of that
  std::optional<double> step_s;  ///< where all steps are equally long: one has to fit its period
  /// @param time_steps measure BenchmarkRun::step_wall_s, if the problem knows how
  std::function<BenchmarkRun(bool time_steps)> run;
  /// Indices of the numbers of the reference's response that it answers; empty: all. Asked after
  /// the reference.
  std::function<AnsweredPart()> part = {};

  [[nodiscard]] std::string curve() const {
    return variant.empty() ? method : method + ", " + variant;
  }
};

/// An answer that others are compared with.
struct BenchmarkAnswer {
  std::string method;  ///< its own settings are compared with the other answer
  std::string words;   ///< how it was found
  Eigen::VectorXd response;
};

/// The reference and its cross-check.
struct BenchmarkReference {
  BenchmarkAnswer first;
  BenchmarkAnswer second;  ///< by another method; reference for the settings of the first
  bool exact = false;      ///< the reference is a closed form
  int components = 1;      ///< of a response at a time: numbers that stand in a row, a vector
  double peak = 0.0;       ///< largest absolute response of the reference, in the problem's unit
  double agreement = 0.0;  ///< largest difference of the two, in parts of the peak
  double floor = 0.0;      ///< errors below this, in parts of the peak, cannot be told

  /// The floor of a part of the response by itself, not above that of the whole.
  [[nodiscard]] double floor_of(const AnsweredPart& part) const;
  /// The answer that settings of a method are compared with: no method is its own reference.
  [[nodiscard]] const Eigen::VectorXd& response_for(std::string_view method) const {
    return method == first.method ? second.response : first.response;
  }
};

/// The absolute values of responses that are numbers or vectors.
/// @param components divides the size
[[nodiscard]] Eigen::VectorXd sizes_of(const Eigen::VectorXd& response, int components);

/// Accuracy of an answer of a closed form: rounding.
inline constexpr double kExactFloor = 1e-14;

/// Compares two answers. The floor is ten times their difference, so that they agree to a tenth of
/// every error that is reported; of a closed form it is kExactFloor.
/// @param worst_floor the largest floor to be accepted, in parts of the peak; for an exact
///   reference ten times the difference must not exceed it either
/// Throws Error(numerical) with `where` if it is larger, if the answers are not finite or differ in
/// size, or if both come from one method.
[[nodiscard]] BenchmarkReference checked_reference(BenchmarkAnswer first, BenchmarkAnswer second,
                                                   bool exact, double worst_floor,
                                                   std::string_view where, int components = 1);

/// Limits that a curve is to keep, over all its settings.
struct BenchmarkTarget {
  std::string curve;
  double error = 0.0;          ///< in parts of the peak
  double step_median_s = 0.0;  ///< wall time of a step
  double step_p99_s = 0.0;     ///< 0: none
  double build_s = 0.0;        ///< 0: none
};

/// A named problem: what is asked, in which ways, and what the answer is.
struct BenchmarkProblem {
  std::string name;          ///< a file name without ending
  std::string title;         ///< a line
  std::string text;          ///< sentences: scene, protocol, material, what counts as error
  std::string response;      ///< "contact force" or "depth"
  std::string unit = "N";    ///< of the response; empty: a share of its peak already
  double simulated_s = 0.0;  ///< length of the protocol
  double relaxation_time_s = 0.0;
  std::vector<BenchmarkSetting> settings;  ///< those of a curve in a row, cheapest first
  std::function<BenchmarkReference()> reference;
  /// Of problems whose settings are one model each at several relaxation times: what each curve is
  /// to keep. Others have none.
  std::vector<BenchmarkTarget> targets = {};
};

/// A line of the list of problems.
struct BenchmarkEntry {
  std::string_view name;
  std::string_view summary;
  BenchmarkProblem (*make)();
};

/// All problems, in the order of the report.
[[nodiscard]] std::span<const BenchmarkEntry> benchmark_entries();

/// The entries of these names, in the order of the list; all for none.
/// Throws Error(usage) with the known names for one that is not there.
[[nodiscard]] std::vector<BenchmarkEntry> chosen_benchmarks(std::span<const std::string> names);

}  // namespace tpm::accuracy
