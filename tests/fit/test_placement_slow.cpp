// Intervals of fits whose zero, contact and drift were measured: reports/fits has more of
// them.
#include <catch2/catch.hpp>

#include "placement_studies.hpp"

using namespace tpm;
using test::PlacedTest;

TEST_CASE("intervals with the prior of a drift hold the true value in 93 to 97 %", "[placement]") {
  PlacedTest made;
  made.rest_s = 10.0;
  made.noise_N = 1e-3;
  made.step_s = 0.2;
  constexpr int kSimulations = 300;
  const auto c = test::drift_coverage(made, 3e-4, kSimulations, 31);
  CHECK(c.told == kSimulations);
  for (const test::Held& p : c.parameters) {
    // 93 to 97 % give or take 2.6 standard deviations of 300 trials.
    INFO(p.name << ": " << p.held << " of " << p.trials);
    CHECK(p.share() >= 0.915);
    CHECK(p.share() <= 0.985);
  }
}
