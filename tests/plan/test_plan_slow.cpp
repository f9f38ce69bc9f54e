// Plans of the paper's liver, and of random scenes.
#include <algorithm>
#include <catch2/catch.hpp>

#include "random_plan_scene.hpp"
#include "simulated_scene.hpp"
#include "tpm/plan/plan.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::plan;

namespace {

ExperimentScene config(const std::string& name) {
  return read_experiment(std::string(TPM_TEST_SOURCE_DIR) + "/configs/plan/" + name + ".json");
}

}  // namespace

TEST_CASE("a shallow push of the paper's liver at 1 kHz") {
  PlanRequest request;
  request.budget.rate_Hz = 1000.0;
  request.relevance = false;
  const Plan plan = make_plan(config("shallow"), request);
  REQUIRE(plan.choice);
  CHECK(plan.chosen().formulation == "linear");
  CHECK(*plan.chosen().verified_error <= request.tolerance);
  REQUIRE(plan.changes.size() == 3);
  CHECK(plan.changes[0].factor);  // deeper is not linear
}

TEST_CASE("a tool needs the full nonlinear network") {
  PlanRequest request;
  request.tolerance = 0.01;
  request.relevance = request.changes = false;
  const Plan plan =
      make_plan(test::experiment(
                    R"({"organ": {"kind": "liver", "count": 50}, "material": {"eta1": "16800 Pa s"},
        "contacts": [{"kind": "ball", "radius": "4 mm"}],
        "protocol": {"kind": "knots", "knots": [{"time": "0 s", "depth": "0 mm"},
        {"time": "1 s", "depth": "2 mm"}, {"time": "1.5 s", "depth": "-2 mm"}]}})"),
                request);
  REQUIRE(plan.choice);
  CHECK(plan.needs_full);
  CHECK(plan.chosen().reach == ModelReach::full);
  const auto linear = std::find_if(plan.candidates.begin(), plan.candidates.end(),
                                   [](const auto& c) { return c.name == "linear_1"; });
  REQUIRE(linear != plan.candidates.end());
  CHECK_THAT(linear->reason, Catch::Matchers::Contains("a tool"));
}

TEST_CASE("a plan whose runs take long ends at twice its reference") {
  PlanRequest request;
  request.tolerance = 0.01;
  Json scene = read_json(std::string(TPM_TEST_SOURCE_DIR) + "/configs/plan/tool.json");
  scene["organ"]["count"] = 1000;
  const Plan plan = make_plan(parse_experiment(scene, "tool", "."), request);
  REQUIRE(plan.choice);
  CHECK(plan.work.reference_s > 1.0);
  CHECK(plan.work.all_s <= 2.02 * plan.work.reference_s);  // the last run ends with a step
  CHECK(*plan.chosen().verified_error <= request.tolerance);
  for (const PlanChange& change : plan.changes) CHECK(change.survived == 1.0);
}

TEST_CASE("ten random scenes keep their claims") {
  int claims = 0, violated = 0;
  for (int i = 0; i < 10; ++i) {
    const test::RandomPlan random(1, i);
    CAPTURE(i, random.words());
    Plan plan;
    try {
      plan = make_plan(random.scene(), random.request());
    } catch (const Error& error) {
      CHECK(error.code() == ExitCode::numerical);  // buckles
      continue;
    }
    for (const PlannedCandidate& c : plan.candidates) {
      if (!c.claimed_error || !c.verified_error) continue;
      ++claims;
      if (*c.verified_error > *c.claimed_error + plan.reference.difference) ++violated;
    }
    if (plan.choice) CHECK(*plan.chosen().verified_error <= plan.request.tolerance);
  }
  CHECK(claims > 50);
  CHECK(violated <= std::max(1, claims / 50));
}
