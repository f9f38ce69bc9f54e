// Steps and staircases that the samples do not resolve, at more places than the fast test takes.
#include "driven_solid.hpp"

using namespace tpm;

TEST_CASE("steps between two samples bias no interval, wherever they lie", "[rise]") {
  test::check_step_between_samples(GENERATE(5.001, 5.015, 5.022));
}

TEST_CASE("steps of other staircases between samples have delays of their own", "[rise]") {
  test::check_stairs_between_samples(GENERATE(2, 3));
}
