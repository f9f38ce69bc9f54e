// Zero and onset in noise that wanders: neighbouring samples correlated by 0.9, few of them.
#include <catch2/catch.hpp>
#include <cmath>

#include "placed_recordings.hpp"

using namespace tpm;
using namespace tpm::fit;
using test::PlacedTest;

namespace {

constexpr int kSeeds = 200;

/// Noise of 1 % of the peak; the machine moves through 2 mm of air in 0.5 s.
PlacedTest wandering(const std::string& law) {
  PlacedTest test;
  test.law = law;
  test.rest_s = 4.0;
  test.ramp_s = 1.0;
  test.hold_s = 20.0;
  test.step_s = 0.1;
  test.start_m = -2e-3;
  test.noise_N = 3e-3;
  test.phi = 0.9;
  return test;
}

/// sqrt of the mean of z^2.
struct Scores {
  double squares = 0.0;
  int count = 0;

  void add(double z) {
    squares += z * z;
    ++count;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
};

}  // namespace

TEST_CASE("noise that wanders at rest is no touch", "[placement][recording]") {
  const PlacedTest test = wandering("linear-1");
  const Recording clean = placed(test);
  int early = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Random random(seed);
    const PreparedRecording r = prepare_recording("made.csv", measured(test, clean, random));
    REQUIRE(r.phases.contact_found);
    early += r.phases.contact_drive < -1e-3 ? 1 : 0;
  }
  CHECK(early == 0);
}

TEST_CASE(
    "an onset from a ramp of few samples, and the zero of a short rest, are as uncertain as said",
    "[placement]") {
  for (const char* law : {"linear-1", "hertz-1"}) {
    INFO(law);
    const PlacedTest test = wandering(law);
    const Recording clean = placed(test);
    Scores onset, zero;
    int within = 0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      Random random(seed);
      const PreparedRecording r = prepare_recording("made.csv", measured(test, clean, random));
      const MeasuredPlacement m = measure_placement(r, spec_of(test), {});
      REQUIRE(m.rests.zero);
      // The onset is where the first sample lay deeper than the surface by test.start_m.
      onset.add(m.onset.drive.value / m.onset.drive.sd);
      const double z = m.rests.zero->value / m.rests.zero->sd;
      zero.add(z);
      within += std::abs(z) < 1.96 ? 1 : 0;
    }
    INFO("onset " << onset.rms() << ", zero " << zero.rms() << ", within " << within);
    CHECK(onset.rms() < 1.2);
    // Exact 99.9 % limits of the rms of as many normal numbers are 0.84 and 1.17.
    CHECK(zero.rms() < 1.17);
    CHECK(within >= 180);  // 95 % of 200 are at least this many with a probability of 99.9 %
  }
}

TEST_CASE("a spoilt reading at rest does not move the zero", "[placement]") {
  PlacedTest test = wandering("linear-1");
  test.phi = 0.0;
  Recording r = placed(test);
  Random random(3);
  r = measured(test, r, random);
  const auto zero_of = [&](const Recording& recording) {
    return measure_placement(prepare_recording("made.csv", recording), spec_of(test), {})
        .rests.zero->value;
  };
  const double clean = zero_of(r);
  r.response[12] += 20.0 * test.noise_N;
  CHECK(std::abs(zero_of(r) - clean) < 0.1 * test.noise_N);
}
