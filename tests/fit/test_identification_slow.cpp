// Coverage at the stopping time, and ten thousand hand-overs (reports/chain has the long runs).
#include <catch2/catch.hpp>

#include "coverage_studies.hpp"
#include "random_hand_over.hpp"

namespace tpm::fit {

TEST_CASE("intervals at the stopping time hold the true value as often as they say") {
  constexpr int kSimulations = 60;
  constexpr double kRejected = 1e-3;
  for (const double phi : {0.0, 0.9}) {
    IdentifyOptions options;
    options.target = phi > 0.0 ? 0.15 : 0.05;
    const auto c = test::stopped_coverage(parse_law_name("linear-1", "test"),
                                          test::even_test(phi > 0.0 ? 30.0 : 20.0, 0.02), 0.02, phi,
                                          options, kSimulations, 3);
    CAPTURE(phi, c.stopped);
    CHECK(c.stopped > kSimulations / 2);
    for (std::size_t k = 0; k < c.names.size(); ++k) {
      CAPTURE(c.names[k], c.parameters[k].held, c.parameters[k].trials);
      CHECK(test::binomial_p(c.parameters[k], 0.95) > kRejected);
    }
  }
}

TEST_CASE("ten thousand hand-overs never store more energy than before, but for rounding") {
  Random random(0);
  int possible = 0;
  double risen = -1.0, jump = 0.0;
  while (possible < 10'000) {
    const test::HandOverOutcome o = test::random_hand_over(random);
    if (!o.decision.possible) continue;
    ++possible;
    risen = std::max(risen, o.energy_risen_J / o.largest_energy_J);
    jump = std::max(jump, o.force_jump_N / o.largest_force_N);
  }
  CAPTURE(risen, jump);
  CHECK(risen < 1e-12);
  CHECK(jump < 1e-12);
}

TEST_CASE("contact is estimated where it was found in noise") {
  // Two or three samples before contact: fixed where it was found, 76 % of intervals held k1.
  const auto c = test::fit_coverage(parse_law_name("linear-1", "test"), test::even_test(10.0, 0.02),
                                    0.02, 0.0, Nuisance::automatic, 100, 3);
  REQUIRE(c.names.size() == 3);
  for (std::size_t k = 0; k < c.names.size(); ++k) {
    CAPTURE(c.names[k], c.parameters[k].held, c.parameters[k].trials);
    CHECK(test::binomial_p(c.parameters[k], 0.95) > 1e-3);
  }
}

}  // namespace tpm::fit
