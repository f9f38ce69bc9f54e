// The states that a quasi-static run shows on its way, and runs that begin at one.
#include <catch2/catch.hpp>
#include <limits>

#include "organ_scene.hpp"
#include "star_network.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using tpm::testing::OrganScene;

namespace {

struct SeenRun {
  QuasiStaticRun run;
  std::vector<QuasiStaticState> states;
};

/// A liver of 60 spheres with a material that relaxes in 0.7 s.
struct Scene {
  Scene() : organ(liver()), bonds(organ.network, material()) {}
  static Organ liver() {
    LiverRequest request;
    request.count = 60;
    return fill_liver(request);
  }
  static TpmParameters material() { return TpmParameters{}.with_relaxation_time(0.7); }
  [[nodiscard]] SeenRun see(const Protocol& protocol, const std::vector<double>& times,
                            const QuasiStaticState* from = nullptr) const {
    SeenRun seen;
    const QuasiStatic network(bonds, organ.network.organ.position, organ.constraints, organ.probe,
                              {.tolerance = kTolerance, .energies = true});
    seen.run = network.run(
        protocol, times, [&](const QuasiStaticState& s) { seen.states.push_back(s); }, from);
    return seen;
  }
  static constexpr double kTolerance = 1e-8;
  OrganScene organ;
  BondSystem bonds;
};

/// Ramps, a jump, and the last value held.
Protocol walk(Drive drive) {
  const double unit = drive == Drive::displacement ? 1e-3 : 0.05;
  return {drive,
          {{0.0, 0.0}, {1.0, 4 * unit}, {2.0, 4 * unit}, {2.0, 2 * unit}, {3.0, 3 * unit}},
          "walk",
          true};
}

const std::vector<double> kSeenTimes_s{0.0, 0.3, 1.0, 1.37, 2.0, 2.01, 2.5, 3.0, 4.4};

}  // namespace

TEST_CASE("the states shown are those of the responses, in the order of time") {
  const Scene scene;
  const std::vector<double> times{2.5, 0.3, 1.0, 2.0, 4.4};
  for (const Drive drive : {Drive::displacement, Drive::force}) {
    const SeenRun seen = scene.see(walk(drive), times);
    REQUIRE(seen.states.size() == times.size());
    const std::vector<std::size_t> order{1, 2, 3, 0, 4};
    for (std::size_t i = 0; i < order.size(); ++i) {
      CHECK(seen.states[i].time_s == times[order[i]]);
      CHECK(seen.states[i].response == seen.run.response[static_cast<Eigen::Index>(order[i])]);
    }
    // Not observed, the same responses to the bit.
    const QuasiStaticRun plain = scene.organ.run(
        Scene::material(), walk(drive), times, {.tolerance = Scene::kTolerance, .energies = true});
    CHECK(plain.response == seen.run.response);
  }
}

TEST_CASE("the forces of a state balance, and its response is that of its positions") {
  const Scene scene;
  for (const Drive drive : {Drive::displacement, Drive::force}) {
    const SeenRun seen = scene.see(walk(drive), kSeenTimes_s);
    const auto probe = static_cast<Eigen::Index>(scene.organ.probe.sphere);
    const Eigen::Vector3d& axis = scene.organ.probe.direction;
    for (const QuasiStaticState& state : seen.states) {
      CAPTURE(state.time_s, drive == Drive::force);
      Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, state.position.cols());
      scene.bonds.add_forces(state.position, {state.viscous.col(0), 0.0}, force);
      const double contact = -force.col(probe).dot(axis);
      const double depth =
          (state.position - scene.organ.network.organ.position).col(probe).dot(axis);
      const bool by_depth = drive == Drive::displacement;
      CHECK_THAT(by_depth ? depth : contact, WithinAbs(state.imposed, 1e-9));
      CHECK_THAT(by_depth ? contact : depth, WithinAbs(state.response, by_depth ? 1e-8 : 1e-10));
      force.col(probe) += contact * axis;
      scene.organ.constraints.project(force);
      CHECK(force.cwiseAbs().maxCoeff() < 1e-8);
    }
  }
}

TEST_CASE("the account of the energy closes at every state") {
  const Scene scene;
  for (const Drive drive : {Drive::displacement, Drive::force}) {
    const SeenRun seen = scene.see(walk(drive), kSeenTimes_s);
    const double scale = seen.states.back().energy->dissipated_J;
    CHECK(scale > 0.0);
    double before = 0.0;
    for (const QuasiStaticState& state : seen.states) {
      CAPTURE(state.time_s);
      REQUIRE(state.energy);
      CHECK(state.energy->dissipated_J >= before);
      before = state.energy->dissipated_J;
      CHECK_THAT(state.energy->stored_J + state.energy->dissipated_J,
                 WithinAbs(state.energy->work_J, 1e-6 * scale));
    }
    CHECK_THAT(seen.states.back().energy->work_J, WithinRel(seen.run.energy->work_J, 1e-9));
  }
}

TEST_CASE("a run in two halves is one run") {
  const Scene scene;
  for (const Drive drive : {Drive::displacement, Drive::force}) {
    const SeenRun whole = scene.see(walk(drive), kSeenTimes_s);
    const double peak = whole.run.response.cwiseAbs().maxCoeff();
    for (std::size_t cut = 0; cut < kSeenTimes_s.size(); ++cut) {
      const auto at = static_cast<std::ptrdiff_t>(cut);
      const SeenRun rest = scene.see(walk(drive), {kSeenTimes_s.begin() + at, kSeenTimes_s.end()},
                                     &whole.states[cut]);
      CAPTURE(cut, kSeenTimes_s[cut], drive == Drive::force);
      CHECK((rest.run.response - whole.run.response.tail(rest.run.response.size()))
                .cwiseAbs()
                .maxCoeff() < 3 * Scene::kTolerance * peak);
      CHECK((rest.states.back().position - whole.states.back().position).cwiseAbs().maxCoeff() <
            1e-9);
      CHECK_THAT(rest.run.energy->work_J, WithinRel(whole.run.energy->work_J, 1e-6));
    }
  }
}

TEST_CASE("a run from a state ends at full relaxation as one run does") {
  const tpm::TpmParameters p = Scene::material();
  const tpm_test::Star star(p);
  const Protocol protocol = step_and_hold(2e-3, std::numeric_limits<double>::infinity());
  std::vector<QuasiStaticState> states;
  const QuasiStatic network(star.bonds, star.network.organ.position, star.constraints,
                            tpm_test::Star::probe(), {.tolerance = 1e-9});
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<double> times{0.0, 0.5, inf};
  const QuasiStaticRun whole =
      network.run(protocol, times, [&](const QuasiStaticState& s) { states.push_back(s); });
  CHECK(states.back().time_s == inf);
  const std::vector<double> later{0.5, inf};
  const QuasiStaticRun rest = network.run(protocol, later, {}, &states[1]);
  CHECK_THAT(rest.response[0], WithinRel(whole.response[1], 1e-9));
  CHECK_THAT(rest.response[1], WithinRel(whole.response[2], 1e-9));
}

TEST_CASE("what no run can begin at is refused") {
  const Scene scene;
  const SeenRun seen = scene.see(walk(Drive::displacement), {1.0});
  CHECK_THROWS_WITH(scene.see(walk(Drive::displacement), {0.5}, &seen.states[0]),
                    Catch::Contains("times from 1 s on"));
  QuasiStaticState other = seen.states[0];
  other.position.conservativeResize(3, 5);
  CHECK_THROWS_WITH(scene.see(walk(Drive::displacement), {2.0}, &other),
                    Catch::Contains("5 spheres"));
}
