// Plans of scenes whose contacts have protocols of their own, or on which loads act.
#include <catch2/catch.hpp>
#include <cmath>

#include "simulated_scene.hpp"
#include "tpm/plan/plan_relevance.hpp"
#include "tpm/plan/show/plan_report.hpp"

using namespace tpm;
using namespace tpm::plan;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::experiment;

namespace {

const std::string kLiver =
    R"({"organ": {"kind": "liver", "count": 50}, "material": {"eta1": "16800 Pa s"}, )";
const std::string kShallowRamp =
    R"("protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "2 mm/s",
    "hold": "2 s"})";
const std::string kSine =
    R"("protocol": {"kind": "sine", "depth": "3 mm", "frequency": "0.5 Hz", "cycles": 2})";
const std::string kGravity =
    R"("loads": [{"kind": "gravity", "direction": [0, -1, 0], "mass_kg": 0.1}], )";

/// The organ's own contact and the free outer sphere farthest from it.
std::string two(const std::string& first, const std::string& second) {
  const Tissue tissue = experiment(kLiver + kShallowRamp + "}").tissue;
  const Organ& organ = tissue.network.organ;
  const Constraints constraints = tissue.constraints();
  const std::size_t contact = organ.contact.value();
  std::size_t other = contact;
  double farthest = 0.0;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] != 0 || constraints.projector(i) != Eigen::Matrix3d::Identity()) continue;
    const double apart = (organ.position.col(static_cast<Eigen::Index>(i)) -
                          organ.position.col(static_cast<Eigen::Index>(contact)))
                             .norm();
    if (apart <= farthest) continue;
    farthest = apart;
    other = i;
  }
  REQUIRE(other != contact);
  return R"("contacts": [{"kind": "sphere", )" + first + R"(}, {"kind": "sphere", "number": )" +
         std::to_string(other + 1) + ", " + second + "}]";
}

PlanRequest loading_request(double tolerance) {
  PlanRequest request;
  request.tolerance = tolerance;
  request.relevance = request.changes = false;
  return request;
}

/// By an accurate run of simulate's own formulation, which knows nothing of plans.
double true_error(const Plan& plan, const ExperimentScene& scene) {
  std::vector<double> times;
  for (int i = 1; i <= 200; ++i) times.push_back(scene.protocol.knots().back().time_s * i / 200.0);
  ExperimentScene accurate = scene;
  accurate.formulation.tolerance = 1e-9;
  return trajectory_error(run_planned(plan, scene, times), run_scene(accurate, times, false), {});
}

}  // namespace

TEST_CASE("a plan of contacts with protocols of their own picks what answers as simulate does") {
  const ExperimentScene scene = experiment(kLiver + two(kShallowRamp, kSine) + "}");
  PlanRequest wanted = loading_request(1e-3);
  wanted.relevance = wanted.changes = true;
  const Plan plan = make_plan(scene, wanted);
  REQUIRE(plan.choice);
  CHECK(plan.chosen().formulation == "collocation");
  CHECK(true_error(plan, scene) <= *plan.chosen().claimed_error);
  CHECK(claim_of(plan).quantity == "contact force of the first contact");
  CHECK_THAT(plan_text(plan), Contains("contact force of the first contact"));
  // Both protocols are made deeper, not one of them.
  for (const PlanChange& change : plan.changes) CHECK((change.factor || change.survived > 1.0));
}

TEST_CASE("what one contact does counts in the answer and in the times of another's plan") {
  const ExperimentScene scene = experiment(kLiver + two(kShallowRamp, kSine) + "}");
  const PlanScene planned(scene);
  CHECK(planned.corners().knots().size() > scene.protocol.knots().size() + 100);
  CHECK(planned.corners().knots().back().time_s == planned.protocol().knots().back().time_s);
  const PlanScene deep = planned.deeper(2.0), quick = planned.faster(2.0);
  const auto second = [](const PlanScene& s) -> const Protocol& {
    return s.driven().probes.loading().beside.at(0).protocol;
  };
  CHECK_THAT(second(deep).peak(), WithinRel(6e-3, 1e-12));
  CHECK_THAT(deep.protocol().peak(), WithinRel(4e-3, 1e-12));
  CHECK_THAT(second(quick).end_s(), WithinRel(2.0, 1e-12));
  CHECK_THAT(second(planned).end_s(), WithinRel(4.0, 1e-12));
}

TEST_CASE("what masses do where two contacts move is that of a run with masses", "[heavy]") {
  // The first contact hardly moves: what masses do to its force is the other contact's doing.
  const std::string still = R"("protocol": {"kind": "knots", "knots": [
    {"time": "0 s", "depth": "0 mm"}, {"time": "0.02 s", "depth": "0.002 mm"}, {"time": "0.2 s", "depth": "0.002 mm"}]})";
  const std::string poke = R"("protocol": {"kind": "knots", "knots": [
    {"time": "0 s", "depth": "0 mm"}, {"time": "0.02 s", "depth": "0.1 mm"}, {"time": "0.2 s", "depth": "0.1 mm"}]})";
  for (const auto& [first, second] : {std::pair{poke, still}, std::pair{still, poke}}) {
    const PlanSurrogate surrogate(PlanScene(experiment(kLiver + two(first, second) + "}")), {},
                                  true);
    const double apart_N =
        (surrogate.coarse().response - surrogate.with_masses(1e-5).response).cwiseAbs().maxCoeff();
    CHECK(surrogate.inertia().of_rates > 0.8 * apart_N);
    CHECK(surrogate.inertia().of_rates < 1.3 * apart_N);
  }
}

TEST_CASE("a plan under gravity starts from the sagged tissue", "[heavy]") {
  const ExperimentScene scene = experiment(kLiver + kGravity + kShallowRamp + "}");
  const ExperimentScene without = experiment(kLiver + kShallowRamp + "}");
  const std::vector<double> end{3.0};
  // The load matters, so a model that leaves it out could not pass.
  const double with_N = run_scene(scene, end, false).response[0];
  CHECK(std::abs(run_scene(without, end, false).response[0] - with_N) > 0.005 * with_N);
  PlanRequest wanted = loading_request(1e-3);
  wanted.relevance = wanted.changes = true;
  wanted.budget.rate_Hz = 1000.0;
  const Plan plan = make_plan(scene, wanted);
  REQUIRE(plan.choice);
  CHECK(true_error(plan, scene) <= *plan.chosen().claimed_error);
}

TEST_CASE("tissue that is all relaxed sags as far as tissue that relaxes") {
  const PlanScene scene(experiment(kLiver + kGravity + kShallowRamp + "}"));
  const auto sag = [](const PlanScene& s) { return s.driven().rest; };
  const double far = (sag(scene) - scene.network().organ.position).cwiseAbs().maxCoeff();
  CHECK(far > 1e-4);
  for (const PlanScene& other : {scene.all_relaxed(), scene.nothing_relaxing()}) {
    CHECK((sag(other) - sag(scene)).cwiseAbs().maxCoeff() < 1e-5 * far);
  }
}

TEST_CASE("what masses change is known without the mass of a tool whose depth is imposed") {
  const std::string quick = R"("protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "20 mm/s",
    "hold": "0.5 s"})";
  const auto planned = [&](const std::string& mass, const std::string& protocol) {
    return make_plan(experiment(kLiver + R"("contacts": [{"kind": "ball", "radius": "10 mm")" +
                                mass + "}], " + protocol + "}"),
                     loading_request(0.01));
  };
  const Plan without = planned("", quick);
  REQUIRE(without.masses_left_out);
  CHECK(*without.masses_left_out > 0.01);
  CHECK(without.masses_unknown.empty());
  CHECK(plan_json(without).at("masses_matter") == true);
  // The mass of the tool changes nothing.
  const PlanSurrogate heavy(PlanScene(experiment(kLiver +
                                                 R"("contacts": [{"kind": "ball", "radius": "10 mm",
    "mass_kg": 3}], )" + quick + "}")),
                            {}, false);
  CHECK_THAT(heavy.inertia_share(), WithinRel(*without.masses_left_out, 1e-6));
  // Under a load it does.
  const Plan loaded =
      planned("", R"("protocol": {"kind": "creep", "load": "0.05 N", "duration": "2 s"})");
  CHECK_FALSE(loaded.masses_left_out);
  CHECK_THAT(loaded.masses_unknown, Contains("mass_kg of each tool"));
  CHECK(plan_json(loaded).at("masses_matter").is_null());
  CHECK(plan_remarks(loaded).front().code == "masses_unknown");
}

TEST_CASE("a plan with masses takes less than twice its reference") {
  const ExperimentScene scene = experiment(
      kLiver + R"("formulation": {"kind": "inertial"}, "protocol": {"kind": "knots", "knots": [
    {"time": "0 s", "depth": "0 mm"}, {"time": "0.35 s", "depth": "4 mm"}, {"time": "0.7 s", "depth": "0 mm"},
    {"time": "1.05 s", "depth": "4 mm"}, {"time": "1.4 s", "depth": "0 mm"}]}})");
  PlanRequest wanted = loading_request(0.01);
  wanted.relevance = wanted.changes = true;
  const Plan plan = make_plan(scene, wanted);
  REQUIRE(plan.choice);
  CHECK(plan.inertial);
  CHECK(plan.work.all_s <= 2.0 * plan.work.reference_run_s);
}
