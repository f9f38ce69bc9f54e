// Designs checked by simulation: the spread of fitted estimates against the predicted one.
#include <catch2/catch.hpp>

#include "tpm/fit/design/design.hpp"

using namespace tpm;
using namespace tpm::fit;

namespace {

DesignProblem shipped(const char* name) {
  return read_design(std::string(TPM_TEST_SOURCE_DIR) + "/configs/" + name);
}

}  // namespace

TEST_CASE("a strong design: simulated estimates spread as predicted") {
  DesignProblem problem = shipped("design_meat.json");
  problem.correlation_time_s = 0.0;
  problem.scale_known = true;
  const PlannedExperiment experiment{
      PlannedExperiment::Kind::ramp_hold, 5e-3, 10e-3, 0.0, 60.0, 0.5, 1};
  const DesignCheck check = check_design(problem, experiment, 300, 11);
  CHECK(check.failed == 0);
  for (const CheckedParameter& p : check.parameters) {
    INFO(p.name << " ratio " << p.ratio << " +- " << p.ratio_error << ", bias " << p.bias);
    CHECK(p.agrees);
    // 95 % of 300, four binomial standard errors.
    CHECK(p.covered >= 269);
  }
  const DesignCheck again = check_design(problem, experiment, 20, 11);
  CHECK(check_design(problem, experiment, 20, 11).parameters[0].observed ==
        again.parameters[0].observed);
}

TEST_CASE("a weak design: the warning says that the prediction does not hold") {
  DesignProblem problem = shipped("design_meat.json");
  problem.correlation_time_s = 0.0;
  problem.force_noise.absolute = 0.2;
  const PlannedExperiment experiment{
      PlannedExperiment::Kind::ramp_hold, 2e-3, 0.5e-3, 0.0, 10.0, 0.5, 1};
  const DesignCheck check = check_design(problem, experiment, 60, 3);
  CHECK_FALSE(check.remarks.empty());
}
