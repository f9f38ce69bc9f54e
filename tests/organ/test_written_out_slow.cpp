// The network under branches, ropes and stiffening bonds against the same written out and
// integrated by CVODES.
#include "written_out_scene.hpp"

using namespace tpm_test;

TEST_CASE("a quasi-static network is its branches written out") {
  const Network& network = small_scene().network;
  SECTION("one branch") {
    const BondMaterial m = material_of({0.7}, 0.9);
    check_pair(both(m, written_bonds(network, m)));
  }
  SECTION("five branches") {
    const BondMaterial m = material_of({0.03, 0.2, 0.9, 5.0, 40.0}, 0.8);
    check_pair(both(m, written_bonds(network, m)));
  }
  SECTION("a fractional branch") {
    const BondMaterial m = fractional_material();
    CHECK(m.branches.size() > 4);
    check_pair(both(m, written_bonds(network, m)));
  }
  SECTION("relaxing lateral bonds") {
    BondMaterial m = material_of({0.2, 3.0}, 0.6);
    m.lateral = LateralBond::relaxing;
    check_pair(both(m, written_bonds(network, m)));
  }
  SECTION("ropes") {
    BondMaterial m = material_of({0.2, 3.0}, 0.6);
    m.lateral = LateralBond::tension_only;
    check_pair(both(m, written_bonds(network, m)));
  }
  SECTION("a stiffening potential with linear branches") {
    BondMaterial m = material_of({0.2, 3.0}, 0.6);
    m.potential = elongation_function("cubic", {3e-3});
    check_pair(both(m, written_bonds(network, m)));
  }
  SECTION("branches on a stiffening kernel") {
    BondMaterial m = material_of({0.2, 3.0}, 0.6);
    m.potential = elongation_function("cubic", {3e-3});
    m.kernel = elongation_function("cubic", {2e-3});
    check_pair(both(m, written_bonds(network, m)));
  }
}
