// The zone model on a small organ.
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "organ_scene.hpp"
#include "tpm/accuracy/contact_reference.hpp"
#include "tpm/contact/servo_network.hpp"
#include "tpm/contact/zone_network.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::files;
using namespace tpm::organ;
using namespace tpm::contact;
using namespace tpm::accuracy;
using tpm::testing::OrganScene;

namespace {

const OrganScene& small_liver() {
  static const OrganScene scene = [] {
    LiverRequest request;
    request.count = 80;
    return OrganScene(fill_liver(request));
  }();
  return scene;
}

struct Followed {
  Eigen::Matrix3Xd force_N;
  double estimate_N = 0.0;
};

Followed follow(ContactModel& model, const ContactMotion& motion) {
  Followed followed;
  followed.force_N.resize(3, motion.steps());
  model.reset();
  for (Eigen::Index i = 0; i < motion.steps(); ++i) {
    const ContactAnswer answer = model.step(motion.displacement_m.col(i));
    followed.force_N.col(i) = answer.force_N;
    followed.estimate_N = std::max(followed.estimate_N, answer.error_N);
  }
  return followed;
}

}  // namespace

TEST_CASE("a zone that holds the whole organ is the servo network", "[zone][heavy]") {
  const OrganScene& scene = small_liver();
  const Positions& rest = scene.network.organ.position;
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(0.02));
  const Eigen::Vector3d into = scene.probe.direction;
  ZoneNetwork zone(bonds, rest, scene.constraints, scene.probe.sphere, into, {.rings = 50});
  ServoNetwork whole(bonds, rest, scene.constraints, scene.probe.sphere, into);
  const ContactMotion motion = random_motion_in_space(contact_axes(into), 4e-3, 1e-3, 200, 5, 1e-3);
  const Followed some = follow(zone, motion);
  const Followed all = follow(whole, motion);
  const double peak_N = all.force_N.colwise().norm().maxCoeff();
  CHECK((some.force_N - all.force_N).colwise().norm().maxCoeff() <
        test::allowed_error("zone.whole_organ") * peak_N);
  Eigen::Matrix3Xd of_zone(3, zone.spheres());
  Eigen::Matrix3Xd of_whole(3, whole.spheres());
  zone.displacements(of_zone);
  whole.displacements(of_whole);
  CHECK((of_zone - of_whole).cwiseAbs().maxCoeff() <
        test::allowed_error("zone.whole_organ_field") * of_whole.cwiseAbs().maxCoeff());
}

TEST_CASE("the surroundings of a zone are exact where the network is linear", "[zone][heavy]") {
  const OrganScene& scene = small_liver();
  const Positions& rest = scene.network.organ.position;
  const Eigen::Vector3d into = scene.probe.direction;
  for (const double tau : {2e-3, 10.0}) {
    const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(tau));
    const TouchedTissue tissue{bonds, rest, scene.constraints, scene.probe.sphere};
    ZoneNetwork zone(bonds, rest, scene.constraints, scene.probe.sphere, into,
                     {.rings = 1, .linear_depth_m = 0.0, .frozen_depth_m = 0.0});
    REQUIRE(zone.own_displacements() > 0);
    // So small that nothing is nonlinear; the zone's edge is a few spheres away.
    const ContactMotion motion = ramp_motion(into, 1e-5, 1e-3, 0.03, 1e-3);
    FineContact exact(tissue, 1e-3);
    zone.reset();
    double worst_N = 0.0;
    double peak_N = 0.0;
    for (Eigen::Index i = 0; i < motion.steps(); ++i) {
      const Eigen::Vector3d force_N = exact.step(motion.displacement_m.col(i));
      const Eigen::Vector3d answered_N = zone.step(motion.displacement_m.col(i)).force_N;
      worst_N = std::max(worst_N, (answered_N - force_N).norm());
      peak_N = std::max(peak_N, force_N.norm());
    }
    CAPTURE(tau, worst_N / peak_N);
    CHECK(worst_N < test::allowed_error("zone.linear_surroundings") * peak_N);
    Eigen::Matrix3Xd all(3, zone.spheres());
    zone.displacements(all);
    CHECK((all - (exact.position() - rest)).cwiseAbs().maxCoeff() <
          test::allowed_error("zone.linear_surroundings_field") * 1e-5);
  }
}

TEST_CASE("a zone's error falls with its rings, and the estimate follows", "[zone][heavy]") {
  const OrganScene& scene = small_liver();
  const Positions& rest = scene.network.organ.position;
  const Eigen::Vector3d into = scene.probe.direction;
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(0.02));
  const TouchedTissue tissue{bonds, rest, scene.constraints, scene.probe.sphere};
  const ContactMotion ramp = ramp_motion(into, 6e-3, 0.05, 0.05, 1e-3);
  const Eigen::VectorXd exact = line_reference(tissue, ramp, 1e-9);
  const double peak_N = exact.cwiseAbs().maxCoeff();
  std::vector<double> error;
  for (const int rings : {1, 2}) {
    ZoneNetwork zone(bonds, rest, scene.constraints, scene.probe.sphere, into, {.rings = rings});
    const Followed followed = follow(zone, ramp);
    error.push_back((followed.force_N.transpose() * into - exact).cwiseAbs().maxCoeff() / peak_N);
    CAPTURE(rings, error.back(), followed.estimate_N / (error.back() * peak_N));
    CHECK(followed.estimate_N > 0.3 * error.back() * peak_N);
    CHECK(followed.estimate_N < 10.0 * error.back() * peak_N);
  }
  CHECK(error[1] < error[0]);
  CHECK(error[1] < test::allowed_error("zone.two_rings"));
}

TEST_CASE("a zone at a patch has the force of the network on all of its spheres", "[zone][heavy]") {
  const OrganScene& scene = small_liver();
  const Organ& organ = scene.network.organ;
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(0.02));
  const Eigen::Vector3d into = scene.probe.direction;
  SceneContact contact;
  contact.kind = ContactKind::patch;
  contact.probe = scene.probe;
  contact.radius_m = 1.3 * organ.spacing;
  const std::vector<std::size_t> patch = spheres_of(contact, organ);
  REQUIRE(patch.size() > 3);

  constexpr double kPeriod_s = 1e-3;
  const Protocol push(Drive::displacement, {{0.0, 0.0}, {0.05, 4e-3}, {0.1, 4e-3}, {0.15, 1e-3}},
                      "push");
  std::vector<double> times_s;
  for (int i = 1; i <= 150; ++i) times_s.push_back(kPeriod_s * i);
  Constraints guided = scene.constraints;
  std::vector<Probe> probes;
  for (const std::size_t sphere : patch) {
    guided.slide(sphere, into);
    probes.push_back({sphere, into});
  }
  const QuasiStatic network(bonds, organ.position, guided, Probes(std::move(probes)));
  const Eigen::VectorXd expected_N = network.run(push, times_s).response;
  const double peak_N = expected_N.maxCoeff();

  const auto worst_of = [&](const PushedSpheres& spheres, int rings, double* claim_N) {
    ZoneNetwork zone(bonds, organ.position, scene.constraints, spheres, into, {.rings = rings});
    double worst_N = 0.0;
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const ContactAnswer answer = zone.step(value_at(push, times_s[i]) * into);
      const double force_N = -answer.force_N.dot(into);
      worst_N = std::max(worst_N, std::abs(force_N - expected_N[static_cast<Eigen::Index>(i)]));
      if (claim_N != nullptr) *claim_N = std::max(*claim_N, answer.error_N);
    }
    Eigen::Matrix3Xd all(3, zone.spheres());
    zone.displacements(all);
    for (const std::size_t sphere : spheres) {
      CHECK((all.col(static_cast<Eigen::Index>(sphere)) - 1e-3 * into).norm() < 1e-9);
    }
    return worst_N;
  };
  double claim_N = 0.0;
  const double of_whole = worst_of(PushedSpheres(patch), 50, &claim_N);
  CHECK(of_whole < test::allowed_error("zone.patch_whole_organ") * peak_N);
  CHECK(claim_N > of_whole);
  CHECK(worst_of(PushedSpheres(patch), 2, nullptr) <
        test::allowed_error("zone.patch_two_rings") * peak_N);
  CHECK(worst_of(scene.probe.sphere, 2, nullptr) > 0.2 * peak_N);  // one sphere feels less
}

TEST_CASE("a zone refuses what it cannot do", "[zone][heavy]") {
  const OrganScene& scene = small_liver();
  const Positions& rest = scene.network.organ.position;
  const BondSystem bonds(scene.network, TpmParameters{}.with_relaxation_time(0.02));
  const Eigen::Vector3d into = scene.probe.direction;
  CHECK_THROWS_AS(
      ZoneNetwork(bonds, rest, scene.constraints, scene.probe.sphere, into, {.rings = 0}), Error);
  Constraints guided = scene.constraints;
  std::size_t some = 0;
  while (!scene.constraints.is_free(some) || some == scene.probe.sphere) ++some;
  guided.slide(some, into);
  CHECK_THROWS_AS(ZoneNetwork(bonds, rest, guided, scene.probe.sphere, into), Error);
}
