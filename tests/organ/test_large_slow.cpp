// The iterative equilibrium against the direct one on a solid organ of 4,000 spheres.
#include <catch2/catch.hpp>

#include "indented_scene.hpp"

using namespace tpm;
using namespace tpm::organ;

TEST_CASE("iterative and direct equilibria of 4,000 spheres are the same") {
  compare_solvers({solid_liver(4000), 0.02, 0.03});
}
