// Which spheres are joined and how stiffly: the contact of the liver against the star, the two
// stiffness rules, neighbours, and mechanisms.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>

#include "expected_values.hpp"
#include "star_stiffness.hpp"
#include "tpm/organ/balance/quasistatic.hpp"
#include "tpm/organ/body/liver.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpm/organ/bonds/contact_stiffness.hpp"
#include "tpm/organ/bonds/local_support.hpp"
#include "tpm/organ/bonds/rigidity.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using Eigen::Vector3d;

namespace {

constexpr std::size_t kContact = 70;

/// Moduli that differ, so that nothing agrees by chance.
TpmParameters unequal_material() {
  TpmParameters p;
  p.E1_Pa = 7e3;
  p.E2_Pa = 19e3;
  p.Eprime_Pa = 31e3;
  return p;
}

NetworkOptions with_rule(StiffnessRule rule) {
  NetworkOptions options;
  options.rule = rule;
  return options;
}

/// Everything but the contact is held.
Constraints only_contact_guided(const Network& network) {
  Constraints constraints(network.organ.size());
  for (std::size_t i = 0; i < network.organ.size(); ++i) {
    if (i != kContact) constraints.fix(i);
  }
  constraints.slide(kContact, Vector3d::UnitZ());
  return constraints;
}

/// The lower layer is held.
Constraints inner_layer_fixed(const Organ& organ) {
  Constraints constraints(organ.size());
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] == 1) constraints.fix(i);
  }
  return constraints;
}

struct MeanCounts {
  double lateral = 0.0, radial = 0.0;
};

MeanCounts mean_counts(const Network& network, int layer) {
  MeanCounts mean;
  int spheres = 0;
  const std::vector<BondSums> sums = bond_sums(network);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (network.organ.layer[i] != layer) continue;
    ++spheres;
    mean.lateral += sums[i].lateral_count;
    mean.radial += sums[i].radial_count;
  }
  mean.lateral /= spheres;
  mean.radial /= spheres;
  return mean;
}

}  // namespace

TEST_CASE("sphere 71 among held neighbours is as stiff as the star under the rule normalised",
          "[heavy]") {
  const TpmParameters p = unequal_material();
  const Network network = build_network(paper_liver(), {}, "liver");
  const BondSystem bonds(network, p);
  const ContactStiffness star = star_stiffness(p);
  const ContactStiffness liver =
      held_stiffness(bonds, network.organ.position, kContact, Vector3d::UnitZ());
  CHECK_THAT(star.instantaneous, WithinRel(19e3 * 12.56e-3, 1e-12));
  CHECK_THAT(star.equilibrium, WithinRel(7e3 * 19e3 / 26e3 * 12.56e-3, 1e-12));
  CHECK_THAT(liver.instantaneous, WithinRel(star.instantaneous, 1e-6));
  CHECK_THAT(liver.equilibrium, WithinRel(star.equilibrium, 1e-6));

  // The same as a force, after an indentation by 10 nm in ten picoseconds and in a second.
  const double depth = 1e-8;
  const QuasiStatic tissue(bonds, network.organ.position, only_contact_guided(network),
                           Probe{kContact, Vector3d::UnitZ()}, {1e-9});
  const auto force = [&](double rate, double hold) {
    const Protocol protocol = ramp_and_hold(depth, rate, hold);
    return tissue.run(protocol, std::vector<double>{depth / rate + hold}).response(0);
  };
  CHECK_THAT(force(1e3, 0.0) / depth, WithinRel(star.instantaneous, 1e-6));
  CHECK_THAT(force(1e-8, 1.0) / depth, WithinRel(star.equilibrium, 1e-6));
}

TEST_CASE("under per_bond sphere 71 is stiffer by the sum of its bonds' squared cosines") {
  const TpmParameters p = unequal_material();
  const Network network = build_network(paper_liver(), with_rule(StiffnessRule::per_bond), "liver");
  const BondSums sums = bond_sums(network)[kContact];
  CHECK(sums.lateral_count == 6);
  CHECK(sums.radial_count == 7);
  const BondSystem bonds(network, p);
  const ContactStiffness liver =
      held_stiffness(bonds, network.organ.position, kContact, Vector3d::UnitZ());
  const double factor = liver.instantaneous / star_stiffness(p).instantaneous;
  CHECK_THAT(factor, WithinRel(sums.radial, 1e-6));
  CHECK_THAT(liver.equilibrium / star_stiffness(p).equilibrium, WithinRel(factor, 1e-6));
  CHECK_THAT(factor, test::expected("paper_liver.stiffness_over_star_per_bond"));
}

TEST_CASE("a crowded layer has first neighbours only, as the others have") {
  const Network network = build_network(paper_liver(), {}, "liver");
  const MeanCounts outer = mean_counts(network, 0);
  const MeanCounts inner = mean_counts(network, 1);
  CHECK_THAT(outer.lateral, test::expected("paper_liver.lateral_bonds_outer_layer"));
  CHECK_THAT(inner.lateral, test::expected("paper_liver.lateral_bonds_inner_layer"));
  CHECK_THAT(outer.radial, test::expected("paper_liver.radial_bonds"));
  for (const BondSums& s : bond_sums(network)) {
    CHECK(s.lateral_count >= 5);
    CHECK(s.lateral_count <= 12);
    CHECK(s.radial_count >= 4);
  }
  Constraints held = inner_layer_fixed(network.organ);
  CHECK(zero_energy_modes(BondSystem(network, TpmParameters{}), network.organ.position, held)
            .is_rigid());
}

TEST_CASE("a lattice keeps its neighbours whatever its layers' own spacing") {
  // 1.5 spacings: along an edge, and across the face of a cell.
  const Network cubic = build_network(block(4, 4, 4, 0.02, Lattice::cubic), {}, "block");
  const BondSums inside = bond_sums(cubic)[2 * 25 + 2 * 5 + 2];
  CHECK(inside.lateral_count == 8);
  CHECK(inside.radial_count == 10);
}

TEST_CASE("one radial bond per sphere and a free inner layer is refused, loose spheres named") {
  NetworkOptions options;
  options.diagonals = false;
  const Network network = build_network(paper_liver(), options, "liver");
  const std::vector<BondSums> sums = bond_sums(network);
  Constraints constraints(network.organ.size());
  for (std::size_t i = 0; i < network.organ.size(); ++i) {
    if (network.organ.layer[i] == 0) CHECK(sums[i].radial_count == 1);
    if (network.organ.position(2, static_cast<Eigen::Index>(i)) > 0.135) constraints.fix(i);
  }
  // Its curvature alone resists, a little: no mode is exactly free, but the contact is loose.
  const BondSystem bonds(network, TpmParameters{});
  const std::vector<double> support = local_support(bonds, network.organ, constraints);
  CHECK(support[kContact] < 0.01);
  const std::vector<std::size_t> loose = loose_spheres(support);
  CHECK(std::find(loose.begin(), loose.end(), kContact) != loose.end());
  CHECK_THROWS_WITH(require_supported(bonds, network.organ, constraints, "scene.json"),
                    Catch::StartsWith("scene.json: nearly a mechanism") &&
                        Catch::Contains(fmt::format("sphere{} {}", "s", loose.front() + 1)));

  const Network braced = build_network(paper_liver(), {}, "liver");
  const BondSystem stiff(braced, TpmParameters{});
  CHECK(zero_energy_modes(stiff, braced.organ.position, constraints).is_rigid());
  const std::vector<double> well = local_support(stiff, braced.organ, constraints);
  CHECK(*std::min_element(well.begin(), well.end()) > 0.5);
  CHECK_NOTHROW(require_supported(stiff, braced.organ, constraints, "scene.json"));
}

TEST_CASE("a flat plate without diagonals is an exact mechanism") {
  NetworkOptions options;
  options.diagonals = false;
  const Network plate = build_network(block(4, 4, 1, 0.02, Lattice::cubic), options, "plate");
  Constraints constraints(plate.organ.size());
  for (std::size_t i = 0; i < 5; ++i) constraints.fix(i);  // an edge of the top
  const BondSystem bonds(plate, TpmParameters{});
  CHECK(zero_energy_modes(bonds, plate.organ.position, constraints).count > 20);
  CHECK(loose_spheres(local_support(bonds, plate.organ, constraints)).size() > 10);
}

TEST_CASE("the local support of the star is that of its held neighbours") {
  const Network network = build_network(star(0.02, 0.02), {}, "star");
  Constraints constraints(4);
  constraints.slide(1, Vector3d::UnitZ());
  for (const std::size_t i : {0, 2, 3}) constraints.fix(i);
  CHECK_THAT(local_support(BondSystem(network, TpmParameters{}), network.organ, constraints)[1],
             WithinRel(1.0, 1e-8));
}
