// Intervals of fits whose zero, contact and drift were measured: reports/fits has more of
// them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "placement_studies.hpp"

using namespace tpm;
using namespace tpm::fit;
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

TEST_CASE("a drift that is told by chance is not stated too exactly", "[placement]") {
  // Whether the rests tell a drift depends on the estimated noise: of what is stated for a
  // correlation of 0.9, by every phi that the readings leave possible, half would be told, those
  // whose estimate is small. The most likely phi tells most of them.
  PlacedTest made;
  made.rest_s = made.after_s = 4.0;
  made.ramp_s = 1.0;
  made.hold_s = 20.0;
  made.start_m = -2e-3;
  made.step_s = 0.1;
  made.drift_N_per_s = 4e-4;
  const Recording clean = test::placed(made);
  made.noise_N = 0.01 * *std::ranges::max_element(clean.response);
  constexpr int kSets = 1000;
  for (const double phi : {0.0, 0.9}) {
    made.phi = phi;
    Random random(17);
    int told = 0, held = 0;
    for (int i = 0; i < kSets; ++i) {
      const PreparedRecording r = prepare_recording("made", test::measured(made, clean, random));
      const MeasuredPlacement placement = measure_placement(r, spec_of(made), {});
      if (placement.drift != DriftFinding::told) continue;
      const Measured& drift = placement.rests.drift.value();
      ++told;
      held += std::abs(drift.value - made.drift_N_per_s) <= 1.96 * drift.sd;
    }
    INFO("phi " << phi << ": held in " << held << " of " << told);
    CHECK(told >= (phi == 0.0 ? kSets : 3 * kSets / 4));
    CHECK(held >= 0.926 * told);
    CHECK(held <= 0.971 * told);
  }
}
