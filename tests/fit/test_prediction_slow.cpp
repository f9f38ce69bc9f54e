// Bands of predictions over many simulated recordings (reports/chain has the long run).
#include <catch2/catch.hpp>

#include "coverage_studies.hpp"

namespace tpm::fit {

TEST_CASE("bands hold held-out readings and the true value as often as they say") {
  constexpr int kSimulations = 300;
  constexpr double kRejected = 1e-3;
  const auto c = test::held_out_coverage(parse_law_name("linear-1", "test"),
                                         test::even_test(20.0, 0.05), 0.01, 0.0, kSimulations, 7);
  CAPTURE(c.readings.held, c.means.held, c.all_readings);
  CHECK(c.failed == 0);
  CHECK(test::binomial_p(c.readings, 0.95) > kRejected);
  CHECK(test::binomial_p(c.means, 0.95) > kRejected);
  CHECK(c.all_readings > 0.93);
  CHECK(c.all_readings < 0.97);
}

}  // namespace tpm::fit
