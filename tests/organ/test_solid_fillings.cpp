// What the inside of a solid gives its outer spheres, and what thin bodies are refused for.
#include <algorithm>
#include <catch2/catch.hpp>

#include "organ_meshes.hpp"
#include "refusal.hpp"
#include "solid_fillings.hpp"
#include "tpm/base/random.hpp"
#include "tpm/organ/body/known_margins.hpp"
#include "tpm/organ/body/landing_site.hpp"
#include "tpm/organ/body/mesh_surface.hpp"
#include "tpm/organ/body/neighbours.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/body/solid_support.hpp"
#include "tpm/organ/bonds/outer_support.hpp"
#include "tpm/organ/bonds/rigidity.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using namespace tpm::test;
using Catch::Matchers::Contains;
using Eigen::Vector3d;

namespace {

/// A box from the origin to a corner.
TriangleMesh box(const Vector3d& corner) {
  TriangleMesh mesh = unit_cube();
  mesh.vertices = corner.asDiagonal() * mesh.vertices;
  return mesh;
}

double least_outer_support(const Organ& organ) {
  const std::vector<double> support =
      outer_support(build_network(organ, NetworkOptions{}, "solid"));
  return *std::min_element(support.begin(), support.end());
}

}  // namespace

TEST_CASE(
    "a margin known from points beside it has the sign of the one asked for, and is no larger") {
  constexpr double kSide_m = 0.1, kSpacing_m = 0.01;
  const MeshSurface cube(box(Vector3d::Constant(kSide_m)));
  KnownMargins known(cube, kSpacing_m);
  Random random(7);
  int smaller = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Vector3d point =
        kSide_m * (1.4 * Vector3d(random.uniform(), random.uniform(), random.uniform()) -
                   Vector3d::Constant(0.2));
    const double least = (0.5 + random.uniform()) * kSpacing_m;
    const double margin = -cube.signed_distance(point) - least;
    const double found = known.margin(point, least);
    REQUIRE(std::signbit(found) == std::signbit(margin));
    REQUIRE(std::abs(found) <= std::abs(margin));
    if (std::abs(found) < std::abs(margin)) ++smaller;
  }
  CHECK(smaller > 10'000);  // most are not asked for
}

TEST_CASE("every outer sphere of a solid ball is held from inside") {
  const Sphere ball(0.05);
  for (const Lattice lattice : {Lattice::cubic, Lattice::bcc, Lattice::fcc}) {
    for (const std::size_t count : {300U, 700U, 1000U, 1700U, 3000U}) {
      const Organ organ = solid_of(ball, count, lattice);
      INFO(count << " " << entry_of(kLatticeWords, lattice).text);
      CHECK(organ.size() == count);
      CHECK(least_outer_support(organ) >= kLeastOuterSupport);
      CHECK(least_distance(organ) > 0.6);
    }
  }
}

TEST_CASE("edges of a box and thick plates are held from inside") {
  const MeshSurface cube(box({0.05, 0.05, 0.05}));
  const MeshSurface plate(box({0.08, 0.08, 0.02}));
  for (const Lattice lattice : {Lattice::cubic, Lattice::bcc, Lattice::fcc}) {
    INFO(entry_of(kLatticeWords, lattice).text);
    CHECK(least_outer_support(solid_of(cube, 1500, lattice)) >= kLeastOuterSupport);
    CHECK(least_outer_support(solid_of(plate, 1500, lattice)) >= kLeastOuterSupport);
  }
}

TEST_CASE("three inner spheres are within reach of every outer one of a ball") {
  const Sphere ball(0.05);
  const Organ organ = solid_of(ball, 2000, Lattice::fcc);
  std::vector<int> inside(organ.size(), 0);
  for (const NeighbourPair& pair : pairs_within(organ.position, kSolidReach * organ.spacing)) {
    if (organ.layer[pair.second] > 0) ++inside[pair.first];
  }
  for (std::size_t i = 0; i < organ.size() && organ.layer[i] == 0; ++i) {
    INFO("sphere " << i + 1);
    CHECK(inside[i] >= kWantedInside);
  }
  CHECK(organ.assumptions.back().code == "supporting_spheres");
}

TEST_CASE("a sphere held from one side alone slides, one held from around does not") {
  const Vector3d up = Vector3d::UnitZ();
  const std::vector<Vector3d> around{{0.6, 0.0, -0.8}, {-0.6, 0.0, -0.8}};
  CHECK(steadiness(up, around) == Approx(1.0));
  CHECK(steadiness(up, std::vector<Vector3d>{{0.0, 0.0, -0.3}}) == Approx(1.0));
  // One bond aslant: along c^2, coupling c s, sideways s^2, so that 1/(1 + 4 tan^2) is left.
  const double tangent = 0.75;
  CHECK(steadiness(up, std::vector<Vector3d>{{0.6, 0.0, -0.8}}) ==
        Approx(1.0 / (1.0 + 4.0 * tangent * tangent)));
  CHECK(steadiness(up, {}) == 0.0);
}

TEST_CASE("no outer sphere of a ball is held from one side alone") {
  const Sphere ball(0.05);
  const auto [lattice, count] = GENERATE(table<Lattice, std::size_t>(
      {{Lattice::fcc, 1251}, {Lattice::bcc, 1700}, {Lattice::cubic, 1000}}));
  INFO(count << " " << entry_of(kLatticeWords, lattice).text);
  const Organ organ = solid_of(ball, count, lattice);
  CHECK(organ.size() == count);
  std::vector<std::vector<Vector3d>> inner(organ.size());
  for (const NeighbourPair& pair : pairs_within(organ.position, kSolidReach * organ.spacing)) {
    if (organ.layer[pair.second] > 0) {
      inner[pair.first].emplace_back(organ.position.col(static_cast<Eigen::Index>(pair.second)) -
                                     organ.position.col(static_cast<Eigen::Index>(pair.first)));
    }
  }
  for (std::size_t i = 0; i < organ.size() && organ.layer[i] == 0; ++i) {
    INFO("sphere " << i + 1);
    CHECK(steadiness(organ.normal.col(static_cast<Eigen::Index>(i)), inner[i]) >= kLeastSteadiness);
  }
}

TEST_CASE("an outer sphere that the inside does not hold is refused by number and place") {
  // Two layers, and one sphere beside them in the outer one.
  Organ organ = block(3, 3, 1, 0.01, Lattice::cubic);
  const auto last = organ.position.cols();
  organ.position.conservativeResize(3, last + 1);
  organ.normal.conservativeResize(3, last + 1);
  organ.position.col(last) = Vector3d(0.042, 0.015, 0.01);
  organ.normal.col(last) = Vector3d::UnitZ();
  organ.layer.push_back(0);
  const Network network = build_network(organ, NetworkOptions{}, "block");
  CHECK(outer_support(network).back() < 1e-12);
  const std::string told = refusal_of(
      [&] { require_outer_support(network, Constraints(network.organ.size()), "plate.json"); });
  CHECK_THAT(told, Contains("plate.json: 1 of 17 outer spheres is hardly held from inside: sphere "
                            "33 at (42, 15, 10) mm"));
  Constraints held(network.organ.size());
  held.fix(static_cast<std::size_t>(last));
  CHECK_NOTHROW(require_outer_support(network, held, "plate.json"));
  // The measure does not follow the spacing law, which scales every bond alike.
  NetworkOptions continuum;
  continuum.spacing_law = SpacingLaw::continuum;
  CHECK(outer_support(build_network(organ, continuum, "block")).front() ==
        Approx(outer_support(network).front()));
}

TEST_CASE("the tip of a thin spike is refused by number and place, anchored or not") {
  // A tower on the top of a block: an inner sphere, and 1.4 spacings above it a tip that nothing
  // but this sphere holds. Its stiffness along its normal is sound, sideways it is free.
  Organ organ = block(3, 3, 2, 0.01, Lattice::cubic);
  const auto first = organ.position.cols();
  const Vector3d top = organ.position.col(5);
  organ.position.conservativeResize(3, first + 2);
  organ.normal.conservativeResize(3, first + 2);
  organ.position.col(first) = top + Vector3d(0.0, 0.0, 0.01);
  organ.position.col(first + 1) = top + Vector3d(0.0, 0.0, 0.024);
  organ.normal.rightCols<2>().colwise() = Vector3d::UnitZ();
  organ.layer.push_back(1);
  organ.layer.push_back(0);
  const Network network = build_network(organ, NetworkOptions{}, "tower");
  const auto tip = static_cast<std::size_t>(first + 1);
  Constraints anchored(organ.size());
  for (std::size_t i = 32; i < 48; ++i) anchored.fix(i);  // the plane at the bottom
  const Constraints loose(organ.size());
  for (const Constraints& constraints : {anchored, loose}) {
    CHECK_NOTHROW(require_outer_support(network, constraints, "tower.json"));
    const std::vector<double> hold = least_hold(network, constraints);
    CHECK(hold[tip] < 1e-12);
    CHECK(*std::min_element(hold.begin(), hold.end() - 1) > 5 * kLeastHold);
    CHECK_THAT(
        refusal_of([&] { require_hold(network, constraints, "tower.json"); }),
        Contains("tower.json: 1 sphere is hardly held in some direction: sphere 50 at (10, 10, 44) "
                 "mm"));
    // The search for motions of the whole network names it, too, beside those of a rigid body.
    const BondSystem bonds(network, TpmParameters{});
    const Eigen::MatrixXd whole = whole_motions(organ.position, constraints);
    CHECK(whole.cols() == (constraints.is_free(40) ? 6 : 0));
    const ZeroEnergyModes modes = zero_energy_modes(bonds, organ.position, constraints, whole);
    CHECK(modes.count == 2);
    REQUIRE_FALSE(modes.spheres.empty());
    CHECK(modes.spheres.front() == tip);
  }
  anchored.fix(tip);
  CHECK_NOTHROW(require_hold(network, anchored, "tower.json"));
}

TEST_CASE("points that are pushed into one corner of a thin plate part again") {
  const MeshSurface plate(box({0.06, 0.06, 0.004}));
  for (int i = 0; i < 24; ++i) {
    ShellRequest request;
    request.layers = 1;
    request.spacing = 2.8e-3 + 5e-5 * i;
    CAPTURE(*request.spacing);
    Organ organ;
    REQUIRE_NOTHROW(organ = fill_shell(plate, request));
    CHECK(least_distance(organ) > 0.3);
  }
}

TEST_CASE("a body with no room for three layers is no solid") {
  SolidRequest request;
  request.spacing = 0.005;
  const MeshSurface plate(box({0.08, 0.08, 0.008}));
  CHECK_THROWS_WITH(fill_solid(plate, request), Contains("solid filling: the body is about") &&
                                                    Contains("three layers or more"));
  request.spacing = 0.004;
  CHECK(least_outer_support(fill_solid(plate, request)) >= kLeastOuterSupport);
}

TEST_CASE("flattening around a contact leaves the other face of a plate where it is") {
  const MeshSurface plate(box({0.1, 0.1, 0.006}));
  ShellRequest request;
  request.spacing = 0.006;
  request.layers = 1;
  request.landing = Vector3d(0.05, 0.05, 0.006);
  const Organ organ = fill_shell(plate, request);
  REQUIRE(organ.contact);
  CHECK(organ.position(2, static_cast<Eigen::Index>(*organ.contact)) == Approx(0.006));
  for (Eigen::Index i = 0; i < organ.position.cols(); ++i) {
    const Vector3d at = organ.position.col(i);
    const double off =
        std::min({at.x(), 0.1 - at.x(), at.y(), 0.1 - at.y(), at.z(), 0.006 - at.z()});
    INFO("sphere " << i + 1);
    CHECK(std::abs(off) < 2e-9);
  }
  request.spacing = 0.0179;
  CHECK_THROWS_WITH(fill_shell(plate, request),
                    Contains("spacing: 17.9 mm in a body about") && Contains("thick at most"));
}
