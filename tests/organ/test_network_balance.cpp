// Energy, order of convergence, balance of forces and invariance of the quasi-static network.
#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "organ_scene.hpp"
#include "tpm/base/random.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using tpm::testing::OrganScene;

namespace {

/// A liver small enough for many runs.
const Organ& small_liver() {
  static const Organ organ = [] {
    LiverRequest request;
    request.count = 60;
    return fill_liver(request);
  }();
  return organ;
}

/// Ramps between random depths, from rest and back to it.
Protocol closed_protocol(Random& random) {
  std::vector<Knot> knots{{0.0, 0.0}};
  for (int i = 0; i < 4; ++i) {
    const double time = knots.back().time_s + std::pow(10.0, 2.0 * random.uniform() - 1.0);
    knots.push_back({time, 4e-3 * random.uniform()});
  }
  knots.push_back({knots.back().time_s + 1.0, 0.0});
  return {Drive::displacement, knots};
}

/// The organ with its spheres in another order.
Organ shuffled(const Organ& organ, Random& random) {
  std::vector<std::size_t> from(organ.size());
  std::iota(from.begin(), from.end(), std::size_t{0});
  for (std::size_t i = from.size(); i-- > 1;) std::swap(from[i], from[random.below(i + 1)]);
  Organ other = organ;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const auto to = static_cast<Eigen::Index>(i);
    const auto old = static_cast<Eigen::Index>(from[i]);
    other.position.col(to) = organ.position.col(old);
    other.normal.col(to) = organ.normal.col(old);
    other.layer[i] = organ.layer[from[i]];
    if (from[i] == organ.contact) other.contact = i;
  }
  return other;
}

}  // namespace

TEST_CASE("work done is stored or dissipated, over random closed protocols", "[heavy]") {
  const OrganScene scene(small_liver());
  Random random(0);
  for (int i = 0; i < 6; ++i) {
    const double tau = std::pow(10.0, 4.0 * random.uniform() - 2.0);
    const Protocol protocol = closed_protocol(random);
    const std::vector<double> end{protocol.knots().back().time_s};
    const QuasiStaticRun run = scene.run(TpmParameters{}.with_relaxation_time(tau), protocol, end,
                                         {.tolerance = 1e-11, .energies = true});
    REQUIRE(run.energy);
    CAPTURE(i, tau, run.energy->work_J, run.energy->stored_J, run.energy->dissipated_J);
    CHECK(run.energy->dissipated_J > 0.0);
    CHECK(run.energy->stored_J >= 0.0);
    CHECK_THAT(run.energy->stored_J + run.energy->dissipated_J,
               WithinRel(run.energy->work_J, 1e-9));
  }
}

TEST_CASE("the work of a load is stored or dissipated, at once and for ever") {
  const OrganScene scene(small_liver());
  const double inf = std::numeric_limits<double>::infinity();
  const Protocol protocol(Drive::force, {{0.0, 0.0}, {0.0, 0.05}, {1.0, 0.15}, {3.0, 0.02}},
                          "loads", true);
  const QuasiStaticRun run =
      scene.run(TpmParameters{}.with_relaxation_time(0.7), protocol, std::vector<double>{5.0, inf},
                {.tolerance = 1e-11, .energies = true});
  REQUIRE(run.energy);
  CHECK(run.energy->dissipated_J > 0.0);
  CHECK_THAT(run.energy->stored_J + run.energy->dissipated_J, WithinRel(run.energy->work_J, 1e-9));
}

TEST_CASE("the error falls with the power of the step that the collocation has") {
  const OrganScene scene(small_liver());
  const TpmParameters material = TpmParameters{}.with_relaxation_time(0.5);
  const Protocol protocol(Drive::displacement, {{0.0, 0.0}, {1.0, 6e-3}});
  const std::vector<double> end{1.0};
  const double exact = scene.run(material, protocol, end, {.tolerance = 1e-12}).response[0];
  for (const int stages : {2, 3}) {
    const auto error = [&](double step_s) {
      const QuasiStaticOptions options{.tolerance = 1e-12, .stages = stages, .step_s = step_s};
      return std::abs(scene.run(material, protocol, end, options).response[0] - exact);
    };
    const double order = std::log2(error(1.0 / 8) / error(1.0 / 16));
    CAPTURE(stages, error(1.0 / 4), error(1.0 / 8), error(1.0 / 16));
    CHECK_THAT(order, WithinAbs(2 * stages - 1, 0.1));
  }
}

TEST_CASE("the estimate of a run covers its error, also where balance decides and ropes slacken") {
  const OrganScene scene(small_liver());
  const Protocol protocol = ramp_and_hold(8e-3, 4e-3, 6.0);
  const std::vector<double> times{0.5, 1.0, 1.5, 2.0, 3.0, 8.0};
  const auto lateral = GENERATE(LateralBond::elastic, LateralBond::tension_only);
  const double relaxation_time_s = GENERATE(0.1, 1.0, 20.0);  // of the longest little is followed
  const double tolerance = GENERATE(1e-3, 1e-5);
  CAPTURE(lateral, relaxation_time_s, tolerance);
  const BondSystem bonds(scene.network,
                         TpmParameters{}.with_relaxation_time(relaxation_time_s).bonds(lateral));
  const auto run_at = [&](double at) {
    return QuasiStatic(bonds, scene.network.organ.position, scene.constraints, scene.probe,
                       {.tolerance = at})
        .run(protocol, times);
  };
  const QuasiStaticRun run = run_at(tolerance);
  const double error = (run.response - run_at(1e-9).response).cwiseAbs().maxCoeff();
  CHECK(error <= run.error_estimate);
}

TEST_CASE("a load is taken off at once or over time, and a run goes on from there") {
  const OrganScene scene(small_liver());
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(1.0));
  const double tolerance = GENERATE(1e-3, 1e-6, 1e-9);
  const double taken_off_s = GENERATE(0.0, 0.01);
  CAPTURE(tolerance, taken_off_s);
  const QuasiStatic solver(bonds, scene.network.organ.position, scene.constraints, scene.probe,
                           {.tolerance = tolerance});
  const Protocol protocol(Drive::force,
                          {{0, 0}, {1, 0.02}, {4, 0.02}, {4 + taken_off_s, 0}, {10, 0}});
  QuasiStaticState state;
  const auto keep = [&](const QuasiStaticState& shown) { state = shown; };
  const std::vector<double> loaded{3.9}, first{4.95}, then{9.0};
  const double peak = solver.run(protocol, loaded).response[0];
  const double before = solver.run(protocol, first, keep).response[0];
  const double after = solver.run(protocol, then, {}, &state).response[0];
  const double whole = solver.run(protocol, then).response[0];
  CHECK(after < before);
  CHECK(std::abs(after - whole) <= 2.0 * tolerance * peak);
}

TEST_CASE("the load and the reactions of the anchors balance, in force and in moment") {
  const OrganScene scene(small_liver());
  const TpmParameters material = TpmParameters{}.with_relaxation_time(2.0);
  const Protocol protocol = creep(0.1, 10.0);
  const std::vector<double> end{1.0};
  const QuasiStaticRun run = scene.run(material, protocol, end, {.tolerance = 1e-12});
  const BondSystem bonds(scene.network, material);
  Eigen::Matrix3Xd pull = Eigen::Matrix3Xd::Zero(3, run.position.cols());
  bonds.add_forces(run.position, {run.viscous.col(0), 0.0}, pull);
  const auto pushed = static_cast<Eigen::Index>(scene.probe.sphere);
  Eigen::Vector3d force = 0.1 * scene.probe.direction;
  Eigen::Vector3d moment = Eigen::Vector3d(run.position.col(pushed)).cross(force);
  for (std::size_t i = 0; i < scene.constraints.size(); ++i) {
    if (scene.constraints.projector(i).trace() > 0.5) continue;
    const auto column = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d reaction = -pull.col(column);
    force += reaction;
    moment += Eigen::Vector3d(run.position.col(column)).cross(reaction);
  }
  CHECK(force.norm() < 1e-10 * 0.1);
  CHECK(moment.norm() < 1e-10 * 0.1 * 0.1);
}

TEST_CASE(
    "the response depends neither on the numbers of the spheres nor on where the organ lies") {
  Random random(3);
  const Organ& organ = small_liver();
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const TpmParameters material = TpmParameters{}.with_relaxation_time(1.0);
  const Protocol protocol = ramp_and_hold(6e-3, 4e-3, 5.0);
  const std::vector<double> times{0.3, 1.5, 2.0, 6.5};
  const QuasiStaticOptions options{.tolerance = 1e-11};
  const Eigen::VectorXd response =
      OrganScene(organ).run(material, protocol, times, options).response;
  for (const Organ& other : {shuffled(organ, random), moved(organ, turn, {0.3, -0.1, 0.2})}) {
    const Eigen::VectorXd same = OrganScene(other).run(material, protocol, times, options).response;
    CHECK((same - response).cwiseAbs().maxCoeff() < 1e-9 * response.maxCoeff());
  }
}
