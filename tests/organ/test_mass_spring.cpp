// The mass-spring model, and roughness as the measure that compares it with the tissue.
#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "star_network.hpp"
#include "tpm/base/random.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/balance/mass_spring.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/bonds/roughness.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm_test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();

/// 4 x 4 x 2 spheres, not quite on a lattice, the lower layer fixed.
struct Plate {
  Plate() : network(build_network(organ(), {}, "plate")), constraints(network.organ.size()) {
    for (std::size_t i = 16; i < 32; ++i) constraints.fix(i);
  }
  static Organ organ() {
    Organ o = block(3, 3, 1, 0.02, Lattice::cubic);
    Random random(5);
    for (double& x : o.position.reshaped()) x += 1e-3 * random.normal();
    o.contact = 5;
    return o;
  }
  [[nodiscard]] Probe probe() const { return {5, -Eigen::Vector3d::UnitZ()}; }
  /// Displacements after a load has acted for ever.
  [[nodiscard]] Eigen::Matrix3Xd displacement(const Network& of, const BondMaterial& material,
                                              double load) const {
    const BondSystem bonds(of, material);
    const QuasiStaticRun run = QuasiStatic(bonds, of.organ.position, constraints, probe(), {1e-6})
                                   .run(creep(load, kForever), std::span(&kForever, 1));
    return run.position - of.organ.position;
  }
  Network network;
  Constraints constraints;
};

Eigen::Matrix3Xd random_displacement(Eigen::Index n, std::uint64_t seed) {
  Random random(seed);
  Eigen::Matrix3Xd u(3, n);
  for (double& x : u.reshaped()) x = 1e-3 * random.normal();
  return u;
}

/// Of all spheres.
Eigen::VectorXd normal_unevenness_m(const Network& network, const Eigen::Matrix3Xd& displacement) {
  std::vector<std::size_t> all(network.organ.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return Unevenness(network, all).of(displacement);
}

}  // namespace

TEST_CASE("the contact stiffness of the star is that of its radial bond") {
  const TpmParameters p;
  const Star star(p);
  const auto stiffness = [&](double relaxation_factor) {
    return contact_stiffness_N_per_m(star.bonds, star.network.organ.position, star.constraints,
                                     Star::probe(), relaxation_factor);
  };
  CHECK_THAT(stiffness(1.0),
             WithinRel(p.equilibrium_modulus_Pa() * p.modulus_to_stiffness_m(), 1e-12));
  CHECK_THAT(stiffness(0.0), WithinRel(p.E2_Pa * p.modulus_to_stiffness_m(), 1e-12));
}

TEST_CASE(
    "the mass-spring model meets a small depth like the relaxed tissue, and nothing relaxes") {
  const Plate plate;
  const TpmParameters p;
  const double relaxed =
      contact_stiffness_N_per_m(BondSystem(plate.network, p), plate.network.organ.position,
                                plate.constraints, plate.probe(), 1.0);
  for (const SpringRule rule : {SpringRule::like_the_bonds, SpringRule::equal}) {
    const Network msm = msm_network(plate.network, rule);
    const BondMaterial material = msm_material(msm, plate.constraints, plate.probe(), relaxed);
    const BondSystem springs(msm, material);
    CHECK(springs.relaxing().isZero(0.0));
    const double load = 1e-4;
    const Eigen::Matrix3Xd u = plate.displacement(msm, material, load);
    CHECK_THAT(u.col(5).dot(plate.probe().direction), WithinRel(load / relaxed, 1e-4));
    const std::vector<double> times{0.5, 20.0};
    const Eigen::VectorXd force = QuasiStatic(springs, msm.organ.position, plate.constraints,
                                              plate.probe(), {.tolerance = 1e-10})
                                      .run(ramp_and_hold(1e-3, 4e-3, 30.0), times)
                                      .response;
    CHECK_THAT(force[1], WithinRel(force[0], 1e-9));
  }
}

TEST_CASE("where all bonds share one modulus the springs deform in the same shape") {
  // Before anything relaxes, E2 = E' makes the tissue a mass-spring model with other numbers.
  const Plate plate;
  TpmParameters p;
  const Network msm = msm_network(plate.network, SpringRule::like_the_bonds);
  const double load = 1e-4;
  const auto shape = [](const Eigen::Matrix3Xd& u) { return Eigen::Matrix3Xd(u / u.norm()); };
  const Eigen::Matrix3Xd springs = shape(plate.displacement(msm, p.bonds(), load));
  p.E1_Pa = 1e12;  // never relaxes
  const Eigen::Matrix3Xd unrelaxed = shape(plate.displacement(plate.network, p.bonds(), load));
  CHECK((springs - unrelaxed).norm() < 1e-6);
  p.E1_Pa = 12e3;  // the radial bonds relax to a half, the lateral ones do not
  const Eigen::Matrix3Xd relaxed = shape(plate.displacement(plate.network, p.bonds(), load));
  CHECK((springs - relaxed).norm() > 1e-3);
}

TEST_CASE("unevenness is 0 for translations and small rotations of a curved organ") {
  Plate plate;
  Random random(9);
  for (Eigen::Index i = 0; i < 32; ++i) {  // normals of a curved surface
    plate.network.organ.normal.col(i) =
        (Eigen::Vector3d::UnitZ() + 0.4 * Eigen::Vector3d(random.normal(), random.normal(), 0))
            .normalized();
  }
  const Eigen::Vector3d shift(1e-3, -2e-3, 3e-3);
  const Eigen::Vector3d turn(0.02, 0.01, -0.03);
  Eigen::Matrix3Xd u(3, 32);
  for (Eigen::Index i = 0; i < 32; ++i) {
    u.col(i) = shift + turn.cross(plate.network.organ.position.col(i));
  }
  CHECK(normal_unevenness_m(plate.network, u).cwiseAbs().maxCoeff() < 1e-16);
}

TEST_CASE("on a regular lattice unevenness is a quarter of a^2 times the Laplacian") {
  Organ organ = block(4, 4, 1, 0.02, Lattice::cubic);
  const Network network =
      build_network(organ, {.support = 1.2, .rule = StiffnessRule::per_bond}, "lattice");
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, organ.position.cols());
  // Laplacian of 3 x^2 - y^2 + x y + x: 4 (per metre)
  const auto x = organ.position.row(0).array();
  const auto y = organ.position.row(1).array();
  u.row(2) = 3.0 * x.square() - y.square() + x * y + x;
  const Eigen::VectorXd r = normal_unevenness_m(network, u);
  const double expected = -0.25 * 0.02 * 0.02 * 4.0;
  for (const Eigen::Index inner : {6, 7, 8, 11, 12, 13, 16, 17, 18}) {
    CHECK_THAT(r[inner], WithinAbs(expected, 1e-15));
  }
}

TEST_CASE("one sphere that stands out alone has the roughness that its neighbourhood says") {
  const Organ organ = block(4, 4, 1, 0.02, Lattice::cubic);
  const Network network =
      build_network(organ, {.support = 1.2, .rule = StiffnessRule::per_bond}, "lattice");
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, organ.position.cols());
  u(2, 12) = -1e-3;
  const std::vector<std::size_t> alone{12};
  CHECK_THAT(roughness(network, u, alone), WithinRel(1.0, 1e-12));
  // Its four neighbours see a quarter of it: (1 + 4/16)/5.
  const auto around = spheres_around(network, 12, 1);
  CHECK(around == std::vector<std::size_t>{7, 11, 12, 13, 17});
  CHECK_THAT(roughness(network, u, around), WithinRel(0.5, 1e-12));
  CHECK_THAT(roughness(network, 7.0 * u, around), WithinRel(0.5, 1e-12));
  CHECK(spheres_around(network, 12, 2).size() == 13);
  CHECK_THROWS_WITH(roughness(network, u, {}), Catch::StartsWith("roughness: of no spheres"));
  CHECK_THROWS_WITH(roughness(network, 0.0 * u, alone),
                    Catch::StartsWith("roughness: nothing has moved"));
}

TEST_CASE("roughness depends neither on the numbering nor on a rigid motion of the scene") {
  const Plate plate;
  const Eigen::Matrix3Xd u = random_displacement(32, 4);
  const auto near = spheres_around(plate.network, 5, 1);
  const double plain = roughness(plate.network, u, near);

  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Network turned =
      build_network(moved(Plate::organ(), rotation, {1.0, 2.0, 3.0}), {}, "turned");
  CHECK_THAT(roughness(turned, rotation * u, near), WithinRel(plain, 1e-10));

  std::vector<std::size_t> order(32);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::rotate(order.begin(), order.begin() + 11, order.end());
  Organ other = Plate::organ();
  Eigen::Matrix3Xd v = u;
  std::vector<std::size_t> near_now;
  for (std::size_t i = 0; i < 32; ++i) {
    const auto to = static_cast<Eigen::Index>(i);
    const auto from = static_cast<Eigen::Index>(order[i]);
    other.position.col(to) = plate.network.organ.position.col(from);
    other.layer[i] = plate.network.organ.layer[order[i]];
    v.col(to) = u.col(from);
    if (std::find(near.begin(), near.end(), order[i]) != near.end()) near_now.push_back(i);
  }
  other.contact.reset();
  const Network renumbered = build_network(std::move(other), {}, "renumbered");
  CHECK_THAT(roughness(renumbered, v, near_now), WithinRel(plain, 1e-12));
}

TEST_CASE("the rim is where the normals turn") {
  Organ organ = block(4, 4, 1, 0.02, Lattice::cubic);
  for (const Eigen::Index i : {0, 5, 10, 15, 20}) {  // one side of the outer plane
    organ.normal.col(i) = Eigen::Vector3d(-1, 0, 1).normalized();
  }
  const Network network =
      build_network(organ, {.support = 1.2, .rule = StiffnessRule::per_bond}, "plate");
  // A sphere in the middle of that side has 2 neighbours alike and 1 at 45 degrees, in the mean 15;
  // one beside it has 1 of 4 at 45 degrees.
  CHECK(spheres_at_rim(network, 14.0 * std::numbers::pi / 180.0) ==
        std::vector<std::size_t>{0, 1, 5, 10, 15, 20, 21});
  CHECK(spheres_at_rim(network, 50.0 * std::numbers::pi / 180.0).empty());
}
