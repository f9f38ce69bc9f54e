// How much a plan may take: runs are counted, also those that fail, and end where they may not go
// on.
#include <algorithm>
#include <catch2/catch.hpp>

#include "simulated_scene.hpp"
#include "tpm/plan/plan_relevance.hpp"
#include "tpm/plan/show/plan_report.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::plan;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;

namespace {

ExperimentScene pushed_liver() {
  return test::experiment(
      R"({"organ": {"kind": "liver", "count": 50}, "material": {"eta1": "16800 Pa s"}, "protocol":
      {"kind": "ramp_hold", "depth": "2 mm", "rate": "2 mm/s", "hold": "2 s"}})");
}

double spent_s(const PlanScene& scene) {
  return nominal_costs().seconds_of(scene.spent().all());
}

QuasiStaticOptions to(double tolerance) {
  QuasiStaticOptions options;
  options.tolerance = tolerance;
  return options;
}

}  // namespace

TEST_CASE("every run of a scene, and of what was made from it, is counted") {
  const PlanScene scene(pushed_liver());
  CHECK(spent_s(scene) == 0.0);
  const std::vector<double> times{1.0, 3.0};
  double sum_s = nominal_costs().seconds_of(scene.quasi_static(to(1e-4), times, false).work);
  CHECK_THAT(spent_s(scene), WithinRel(sum_s, 1e-12));
  for (const PlanScene& changed : {scene.stiffer(2.0), scene.deeper(0.5), scene.faster(2.0),
                                   scene.with_layers(1), scene.all_relaxed().deeper(0.5)}) {
    const std::vector<double> begin{0.0};
    sum_s += nominal_costs().seconds_of(changed.quasi_static(to(1e-3), begin, false).work);
    CHECK_THAT(spent_s(scene), WithinRel(sum_s, 1e-12));
  }
}

TEST_CASE("a run ends where it may not go on, and what it took is counted") {
  const PlanScene scene(pushed_liver());
  const std::vector<double> times{1.0, 3.0};
  const double whole_s =
      nominal_costs().seconds_of(scene.quasi_static(to(1e-6), times, false).work);
  for (const double share : {0.1, 0.5}) {
    const PlanScene again(pushed_liver());
    try {
      (void)again.quasi_static(to(1e-6), times, false, share * whole_s);
      FAIL("it went on");
    } catch (const Error& error) {
      CHECK(error.code() == ExitCode::numerical);
      CHECK_THAT(error.what(), Contains("as long as it may"));
    }
    CHECK(spent_s(again) > share * whole_s);
    CHECK(spent_s(again) < whole_s);
  }
  CHECK_NOTHROW(scene.quasi_static(to(1e-6), times, false, 1.001 * whole_s));
}

TEST_CASE("what a claim takes is said before it is made, with what models are compared with") {
  const PlanScene scene(pushed_liver());
  const PlanSurrogate surrogate(scene, {}, false);
  const double first_s = nominal_costs().seconds_of(surrogate.work_of_first());
  const PlanModels models = plan_models(scene);
  const auto named = [&](const std::string& name) {
    return std::find_if(models.begin(), models.end(),
                        [&](const auto& model) { return model->name() == name; });
  };
  const auto full = named("collocation_0.001"), layered = named("collocation_0.001_layers_1");
  REQUIRE(full < layered);  // what needs no more runs comes first
  REQUIRE(layered != models.end());
  const auto asked_s = [&](const PlanModel& model) {
    return nominal_costs().seconds_of(model.work_to_claim(surrogate));
  };
  for (const auto& model : models) {
    CAPTURE(model->name());
    CHECK(asked_s(*model) >= 0.0);
  }
  CHECK_THAT(spent_s(scene), WithinRel(first_s, 1e-12));  // asking runs nothing
  CHECK_THAT(asked_s(**named("linear_1")), WithinRel(first_s, 1e-12));
  CHECK_THAT(asked_s(**layered), WithinRel(2.0 * first_s, 1e-12));
  (void)surrogate.collocation(1e-5);  // as a reference does
  CHECK(asked_s(**full) == 0.0);
  (void)(*full)->claim(surrogate, {});
  CHECK_FALSE(surrogate.has_collocation(PlanSurrogate::kTolerance));
  (void)surrogate.coarse();
  CHECK(asked_s(**named("linear_1")) == 0.0);
  CHECK_THAT(asked_s(**layered),
             WithinRel(nominal_costs().seconds_of(surrogate.coarse().work), 1e-12));
}

TEST_CASE("what a plan has no time for is said, and done where it is thorough", "[heavy]") {
  const PlanScene scene(pushed_liver());
  const PlanSurrogate surrogate(scene, {}, false);
  const PlanModels models = plan_models(scene);
  Plan plan;
  plan.relevance = plan_relevance(surrogate, 0.01, PlanAllowance(scene, 0.0));
  plan.changes = plan_changes(surrogate, *models.front(), {}, 1.0, PlanAllowance(scene, 0.0));
  for (const PlanRelevance& part : plan.relevance) {
    CAPTURE(part.part);
    if (part.part == "inertia") {
      CHECK(part.estimated);  // takes no run
      continue;
    }
    CHECK_FALSE(part.error);
    CHECK(part.matters);
    CHECK_THAT(part.note, Contains("not tried"));
  }
  for (const PlanChange& change : plan.changes) {
    CHECK_FALSE(change.factor);
    CHECK(change.survived == 1.0);
  }
  for (const PlanRelevance& part : plan_relevance(surrogate, 0.01, PlanAllowance(scene))) {
    CAPTURE(part.part);
    CHECK(part.error);
  }
  for (const PlanChange& change :
       plan_changes(surrogate, *models.front(), {}, 1.0, PlanAllowance(scene))) {
    CAPTURE(change.change);
    CHECK((change.factor || change.survived == kMostChange));
  }
}

TEST_CASE("a run that the plan cuts short breaks nothing", "[heavy]") {
  // Room for a try as long as the scene as it is, which deeper ones exceed.
  for (const double tries : {1.01, 1.2, 2.0, 3.0}) {
    CAPTURE(tries);
    const PlanScene scene(pushed_liver());
    const PlanSurrogate surrogate(scene, {}, false);
    const PlanModels models = plan_models(scene);
    const double once_s = nominal_costs().seconds_of(surrogate.work_of_claims());
    const PlanAllowance allowance(scene, spent_s(scene) + 3.0 * tries * once_s);
    PlanRequest lenient;
    lenient.tolerance = 0.5;
    for (const PlanChange& change :
         plan_changes(surrogate, *models.front(), lenient, 1.0, allowance)) {
      CHECK_THAT(change.breaks, !Contains("as long as it may"));
    }
    for (const PlanRelevance& part :
         plan_relevance(surrogate, 0.01, PlanAllowance(scene, spent_s(scene) + 1.01 * once_s))) {
      CHECK_THAT(part.note, !Contains("as long as it may"));
    }
  }
}

TEST_CASE("what planning takes is expected from its first run", "[heavy]") {
  constexpr double kTwice = 2.0;
  for (const double tolerance : {0.07, 0.01, 1e-4}) {
    CAPTURE(tolerance);
    PlanRequest request;
    request.tolerance = tolerance;
    request.relevance = request.changes = false;
    const ExpectedPlanWork expected = expected_work(pushed_liver(), request);
    std::optional<ExpectedPlanWork> told;
    request.expected = [&](const ExpectedPlanWork& work) { told = work; };
    const Plan plan = make_plan(pushed_liver(), request);
    REQUIRE(told);
    CHECK(told->reference_s == expected.reference_s);
    CHECK(plan.work.first_run_s == expected.first_run_s);
    CHECK(plan.work.reference_s > expected.reference_s / kTwice);
    CHECK(plan.work.reference_s < expected.reference_s * kTwice);
    REQUIRE(expected.all_s);
    CHECK(plan.work.all_s <= *expected.all_s);
    CHECK(plan.work.all_s > plan.work.reference_s);
    request.thorough = true;
    CHECK_FALSE(expected_work(pushed_liver(), request).all_s);
  }
}
