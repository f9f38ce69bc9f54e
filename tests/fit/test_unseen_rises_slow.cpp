// Steps and staircases that the samples do not resolve, at more places than the fast tests take.
#include "driven_solid.hpp"

using namespace tpm;

TEST_CASE("steps between two samples bias no interval, wherever they lie", "[rise]") {
  test::check_step_between_samples(GENERATE(5.001, 5.015, 5.022, 5.029));
}

TEST_CASE("each step of a staircase between samples has a delay of its own", "[rise]") {
  test::check_stairs_between_samples(GENERATE(1, 2, 3));
}
