#pragma once
// Where each step rule fails: maps, limits, limiting cases, servo rates. See docs/accuracy.md.
#include <optional>
#include <string>
#include <vector>

#include "tpm/accuracy/stability/verdict.hpp"

namespace tpm::accuracy {

/// One run of a map.
struct StabilityPoint {
  double x = 0.0;       ///< in the unit of the map's axis, SI
  double step_s = 0.0;  ///< s
  StabilityVerdict verdict;
};

/// One rule over a plane of a property and the step.
struct StabilityMap {
  std::string id;        ///< "relaxation_time"
  std::string quantity;  ///< "relaxation time"
  std::string unit;      ///< "s", SI
  std::string problem;   ///< what is run, in words
  StepRule rule = StepRule::forward_euler;
  std::vector<StabilityPoint> points;
  /// Limits of linear theory; empty where the rule has none.
  std::vector<double> limit_x, limit_step_s;
};

/// A limit found by bisection beside that of theory.
struct StabilityLimit {
  std::string problem;  ///< with the fixed part of a network
  StepRule rule = StepRule::forward_euler;
  std::string theory;  ///< its formula
  double theory_s = 0.0;
  double found_s = 0.0;
  bool at_papers_eta1 = false;
  [[nodiscard]] double ratio() const { return found_s / theory_s; }
};

struct LimitingCell {
  StepRule rule = StepRule::forward_euler;
  StabilityVerdict verdict;
  StabilityClass expected = StabilityClass::holds;
  /// As expected; of two failures of one kind (diverged, energy grew) each counts for the other.
  bool right = false;
};

/// A degenerate case and what every rule did.
struct LimitingCase {
  std::string name;
  std::string setup;
  std::string expected;  ///< in words
  std::vector<LimitingCell> cells;
};

struct ServoCell {
  StepRule rule = StepRule::forward_euler;
  StabilityVerdict verdict;  ///< its error is that of the whole protocol
};

/// One servo rate at the paper's own eta1.
struct ServoRow {
  std::string problem;
  double rate_Hz = 0.0;
  std::vector<ServoCell> cells;
};

struct StabilityStudy {
  std::vector<StabilityMap> maps;
  std::vector<StabilityLimit> limits;
  std::vector<LimitingCase> limiting_cases;
  std::vector<ServoRow> servo;
};

/// Points along each axis of a map.
inline constexpr int kPointsAlongMaps = 21;
/// @param along points along each axis, >= 2
[[nodiscard]] std::vector<StabilityMap> stability_maps(int along = kPointsAlongMaps);
[[nodiscard]] std::vector<StabilityLimit> stability_limits();
[[nodiscard]] std::vector<LimitingCase> find_limiting_cases();
[[nodiscard]] std::vector<ServoRow> stability_at_servo_rates();
/// Supports of the networks of the study, in a sentence.
[[nodiscard]] std::string study_organ_words();
/// Parts of the study to run.
struct StabilityParts {
  bool maps = true, limits = true, limiting_cases = true, servo = true;
};
/// Deterministic. Parts that are not run stay empty.
/// @param along points along each axis of the maps, >= 2
[[nodiscard]] StabilityStudy run_stability_study(int along = kPointsAlongMaps,
                                                 const StabilityParts& parts = {});

}  // namespace tpm::accuracy
