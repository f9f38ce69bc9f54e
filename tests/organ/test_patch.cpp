// Effective moduli of blocks against closed forms of central-force lattices, and the spacing laws.
#include <catch2/catch.hpp>
#include <cmath>

#include "patch_test.hpp"
#include "tpm/organ/body/simple_organs.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double kCoarseSpacing = 0.02;

struct PatchBlock {
  PatchBlock(Lattice lattice, int cells, double spacing, const NetworkOptions& options,
             const TpmParameters& material = {})
      : network(build_network(block(cells, cells, cells, spacing, lattice), options, "block")),
        bonds(network, material),
        margin(2.0 * options.support * spacing),
        volume(volume_per_sphere(lattice, spacing)) {}
  [[nodiscard]] PatchTest test(double relaxation_factor) const {
    return affine_patch_test(network, bonds, relaxation_factor, margin, volume);
  }
  Network network;
  BondSystem bonds;
  double margin, volume;
};

int cells_for(Lattice lattice) {
  return lattice == Lattice::cubic ? 8 : 6;
}

NetworkOptions options_of(StiffnessRule rule, SpacingLaw law = SpacingLaw::paper) {
  NetworkOptions options;
  options.rule = rule;
  options.spacing_law = law;
  return options;
}

/// C11 and C12 = C44 of a lattice whose bonds all have the stiffness k, in units of k/x: the sums
/// over first and second neighbours by hand.
struct Cubic {
  Lattice lattice;
  double c11, c12;
};
const Cubic kCubic[] = {
    {Lattice::cubic, 3.0, 1.0},
    {Lattice::bcc, 4.0 / std::sqrt(3.0), 1.0 / std::sqrt(3.0)},
    {Lattice::fcc, 3.0 * std::sqrt(2.0), std::sqrt(0.5)},
};

}  // namespace

TEST_CASE("lattices have the elasticity of their first and second neighbours") {
  const TpmParameters material;
  const double unit =
      material.E2_Pa * material.modulus_to_stiffness_m() / kCoarseSpacing;  // k/x, all bonds alike
  for (const Cubic& expected : kCubic) {
    const PatchBlock b(expected.lattice, cells_for(expected.lattice), kCoarseSpacing,
                       options_of(StiffnessRule::per_bond));
    const PatchTest patch = b.test(0.0);
    CAPTURE(static_cast<int>(expected.lattice), patch.interior);
    Elasticity c = Elasticity::Zero();
    c.topLeftCorner<3, 3>().setConstant(expected.c12);
    c.diagonal().head<3>().setConstant(expected.c11);
    c.diagonal().tail<3>().setConstant(expected.c12);
    CHECK((patch.elasticity / unit - c).cwiseAbs().maxCoeff() < 1e-12 * expected.c11);
    CHECK(patch.deviation < 1e-12);

    const Moduli m = moduli_of(patch.elasticity);
    const double nu = expected.c12 / (expected.c11 + expected.c12);
    CHECK_THAT(m.poisson(2, 0), WithinAbs(nu, 1e-12));
    CHECK_THAT(m.volume_change[2], WithinAbs(1.0 - 2.0 * nu, 1e-12));
    CHECK_THAT(m.young_Pa[2] / unit, WithinRel(expected.c11 - 2.0 * nu * expected.c12, 1e-12));
    CHECK_THAT(m.anisotropy, WithinRel(2.0 * expected.c12 / (expected.c11 - expected.c12), 1e-12));
  }
}

TEST_CASE("a cubic lattice with its diagonals is isotropic with a Poisson ratio of 1/4") {
  const PatchBlock b(Lattice::cubic, 8, kCoarseSpacing, options_of(StiffnessRule::per_bond));
  const Moduli m = moduli_of(b.test(0.0).elasticity);
  CHECK_THAT(m.anisotropy, WithinRel(1.0, 1e-12));
  CHECK_THAT(m.poisson(0, 1), WithinRel(0.25, 1e-12));
  CHECK_THAT(m.young_Pa[0], WithinRel(2.0 * (1.0 + 0.25) * m.shear_Pa[0], 1e-12));
}

TEST_CASE(
    "the patch test agrees with the sum over bonds, and central forces have Cauchy symmetry") {
  for (const Cubic& entry : kCubic) {
    const PatchBlock b(entry.lattice, cells_for(entry.lattice), kCoarseSpacing,
                       options_of(StiffnessRule::normalised));
    const auto interior = interior_spheres(b.network.organ, b.margin);
    for (const double relaxation_factor : {0.0, 0.3, 1.0}) {
      const Elasticity solved = b.test(relaxation_factor).elasticity;
      const Elasticity summed = affine_elasticity(b.network, b.bonds, relaxation_factor, interior,
                                                  b.volume * static_cast<double>(interior.size()));
      const double size = summed.cwiseAbs().maxCoeff();
      CHECK((solved - summed).cwiseAbs().maxCoeff() < 1e-12 * size);
      CHECK_THAT(solved(0, 1), WithinAbs(solved(5, 5), 1e-12 * size));
      CHECK_THAT(solved(0, 2), WithinAbs(solved(4, 4), 1e-12 * size));
      CHECK_THAT(solved(1, 2), WithinAbs(solved(3, 3), 1e-12 * size));
    }
  }
}

TEST_CASE("what relaxes halves with equal springs, and lateral bonds keep their stiffness") {
  const PatchBlock b(Lattice::cubic, 8, kCoarseSpacing, options_of(StiffnessRule::normalised));
  const Elasticity instantaneous = b.test(0.0).elasticity;
  const Elasticity relaxed = b.test(1.0).elasticity;
  // Across z only inter-layer bonds carry; along xy both kinds.
  CHECK_THAT(relaxed(2, 2), WithinRel(0.5 * instantaneous(2, 2), 1e-12));
  CHECK_THAT(relaxed(5, 5), WithinRel(instantaneous(5, 5), 1e-12));
  CHECK(relaxed(0, 0) > 0.5 * instantaneous(0, 0));
  CHECK(relaxed(0, 0) < instantaneous(0, 0));
}

TEST_CASE("the continuum law keeps the modulus of a block, the paper's law does not", "[heavy]") {
  for (const Cubic& entry : kCubic) {
    for (const StiffnessRule rule : {StiffnessRule::normalised, StiffnessRule::per_bond}) {
      const auto modulus = [&](SpacingLaw law, double spacing, int more_cells) {
        const PatchBlock b(entry.lattice, cells_for(entry.lattice) + more_cells, spacing,
                           options_of(rule, law));
        return moduli_of(b.test(0.0).elasticity).young_Pa[2];
      };
      const double coarse = modulus(SpacingLaw::continuum, kCoarseSpacing, 0);
      CHECK_THAT(modulus(SpacingLaw::continuum, 0.3 * kCoarseSpacing, 1), WithinRel(coarse, 1e-12));
      CHECK_THAT(modulus(SpacingLaw::paper, kCoarseSpacing, 0), WithinRel(coarse, 1e-12));
      CHECK_THAT(modulus(SpacingLaw::paper, 0.3 * kCoarseSpacing, 1),
                 WithinRel(coarse / 0.3, 1e-12));
    }
  }
}

TEST_CASE("a block between smooth plates comes nearer to the bulk with more cells", "[heavy]") {
  const auto block_of = [](int cells) {
    return PatchBlock(Lattice::cubic, cells, kCoarseSpacing, options_of(StiffnessRule::per_bond));
  };
  const Moduli bulk = moduli_of(block_of(8).test(0.0).elasticity);
  std::vector<double> off;
  for (const int cells : {4, 8, 16}) {
    const PatchBlock b = block_of(cells);
    const PlateTest plates = plate_test(b.network, b.bonds, 0.0);
    CHECK_THAT(plates.poisson[0], WithinAbs(plates.poisson[1], 1e-9));
    CHECK_THAT(plates.volume_change, WithinAbs(1.0 - 2.0 * plates.poisson[0], 1e-9));
    off.push_back(plates.young_Pa / bulk.young_Pa[2] - 1.0);
  }
  CAPTURE(off[0], off[1], off[2]);
  // The faces' share of a block is one over its cells.
  CHECK_THAT(off[0] / off[1], WithinAbs(2.0, 0.3));
  CHECK_THAT(off[1] / off[2], WithinAbs(2.0, 0.15));
}

TEST_CASE("patch tests refuse what they cannot answer") {
  const PatchBlock small(Lattice::cubic, 4, kCoarseSpacing, options_of(StiffnessRule::per_bond));
  CHECK_THROWS_WITH(small.test(0.0), Catch::Contains("no sphere of cubic block"));
  NetworkOptions narrow = options_of(StiffnessRule::per_bond);
  narrow.support = 1.1;  // without diagonals a cubic lattice is a mechanism
  const Network loose =
      build_network(block(4, 4, 4, kCoarseSpacing, Lattice::cubic), narrow, "block");
  const BondSystem bonds(loose, TpmParameters{});
  CHECK_THROWS_WITH(plate_test(loose, bonds, 0.0), Catch::Contains("loose"));
  CHECK_THROWS_AS(moduli_of(Elasticity::Zero()), Error);
}
