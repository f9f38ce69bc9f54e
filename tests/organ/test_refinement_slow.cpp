// Refinement: what a body of fixed size answers under the continuum law, at smaller and smaller x.
#include <catch2/catch.hpp>

#include "expected_values.hpp"
#include "patch_test.hpp"
#include "punch_on_block.hpp"
#include "tpmkit/tpm_element.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEST_CASE("the force of a punch converges with first order under the continuum law") {
  for (const StiffnessRule rule : {StiffnessRule::per_bond, StiffnessRule::normalised}) {
    PunchOnBlock scene;
    scene.rule = rule;
    std::vector<double> force;
    for (const int cells : {4, 8, 16, 32}) force.push_back(punch_stiffness(scene, cells));
    const Richardson first = richardson(force[0], force[1], force[2], 2.0);
    const Richardson second = richardson(force[1], force[2], force[3], 2.0);
    CAPTURE(static_cast<int>(rule), force[0], force[1], force[2], force[3], first.order,
            second.order, first.limit, second.limit);
    CHECK_THAT(second.order, WithinAbs(1.0, 0.2));
    CHECK_THAT(second.limit, WithinRel(first.limit, test::allowed_error("refinement.punch_limit")));
  }
}

TEST_CASE("under the paper's law the force of a punch has no limit") {
  PunchOnBlock scene;
  scene.law = SpacingLaw::paper;
  const double coarse = punch_stiffness(scene, 8);
  const double fine = punch_stiffness(scene, 16);
  CHECK(fine > 1.5 * coarse);
}

TEST_CASE("a block between plates extrapolates to the modulus of the patch test") {
  NetworkOptions options;
  options.rule = StiffnessRule::per_bond;
  options.spacing_law = SpacingLaw::continuum;
  const double side = 0.16;
  const auto plates = [&](int cells) {
    const Network network =
        build_network(block(cells, cells, cells, side / cells, Lattice::cubic), options, "block");
    const BondSystem bonds(network, TpmParameters{});
    return plate_test(network, bonds, 0.0).young_Pa;
  };
  const std::vector<double> young{plates(3), plates(6), plates(12)};
  const double limit = polynomial_limit(young[0], young[1], young[2]);
  const double order = richardson(young[0], young[1], young[2], 2.0).order;
  const double x = side / 8;
  const Network network = build_network(block(8, 8, 8, x, Lattice::cubic), options, "block");
  const BondSystem bonds(network, TpmParameters{});
  const double bulk = moduli_of(affine_patch_test(network, bonds, 0.0, 3.0 * x,
                                                  volume_per_sphere(Lattice::cubic, x))
                                    .elasticity)
                          .young_Pa[2];
  CAPTURE(young[0], young[1], young[2], order, limit, bulk);
  CHECK_THAT(limit, WithinRel(bulk, test::allowed_error("refinement.block_limit")));
  CHECK_THAT(order, WithinAbs(1.0, 0.15));
}
