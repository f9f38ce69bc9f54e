// Step rules on the paper's element against their limits of stability in theory.
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/accuracy/stability/study.hpp"
#include "tpm/accuracy/stability/verdict.hpp"

using namespace tpm;
using namespace tpm::accuracy;

TEST_CASE(
    "a run that stays on one side of the reference has a wrong steady state, whatever rounding "
    "does") {
  const Eigen::VectorXd reference = Eigen::VectorXd::LinSpaced(8, 0.0, 1.0);
  MethodRun run;
  for (const double rounding : {-1e-13, 0.0, 1e-13}) {
    CAPTURE(rounding);
    run.response = reference.array() - 0.2;
    run.response[0] = reference[0] + rounding;
    CHECK(classify_run(run, reference, 1.0, false).found == StabilityClass::wrong_steady_state);
  }
  run.response[0] = reference[0] + 0.01;
  CHECK(classify_run(run, reference, 1.0, false).found == StabilityClass::oscillates);
}

TEST_CASE("what is above the limit of a step rule fails, and what is below does not", "[heavy]") {
  std::size_t cells = 0;
  for (const StabilityMap& map : stability_maps()) {
    if (map.id != "relaxation_time") continue;
    INFO(kStepRules[static_cast<std::size_t>(map.rule)].text);
    for (const StabilityPoint& point : map.points) {
      const double ratio = point.step_s / point.x;
      const bool failed = point.verdict.found == StabilityClass::diverged;
      ++cells;
      if (map.rule == StepRule::forward_euler && std::abs(ratio / 2.0 - 1.0) > 0.1) {
        CHECK(failed == (ratio > 2.0));
      } else if (map.rule == StepRule::rk4 && std::abs(ratio / 2.785 - 1.0) > 0.1) {
        CHECK(failed == (ratio > 2.785));
      } else if (map.limit_x.empty()) {
        CHECK_FALSE(failed);
      }
    }
  }
  CHECK(cells == std::size_t{9} * 21 * 21);
}
