// Fits of all laws after a step that rings, or that a sensor follows late.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "driven_solid.hpp"
#include "placed_recordings.hpp"
#include "tpm/fit/select/selection.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using tpm::test::PlacedTest;

TEST_CASE("the tail of what rings or starts up after a step biases no interval", "[placement]") {
  PlacedTest test;
  test.rest_s = 5.0;
  test.ramp_s = 0.05;  // one sample
  Random random(29);
  Recording r = test::measured(test, test::placed(test), random);
  const bool rings = GENERATE(true, false);
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const double since = r.time_s[i] - 5.05;
    if (since < 0.0) continue;
    if (rings) r.response[i] += 0.05 * std::exp(-since / 0.1) * std::sin(44.0 * since);
    if (!rings) r.response[i] *= 1.0 - std::exp(-(since + 0.05) / 0.15);
  }
  const PreparedRecording prepared = prepare_recording("step.csv", r);
  CHECK(prepared.from_s > (rings ? 5.4 : 5.9));
  CHECK(prepared.from_s < 10.0);
  CHECK_THAT(prepared.start_up, Contains(rings ? "they ring" : "they rise"));
  const std::vector<PreparedRecording> one{prepared};
  const Selection s = select_law(one, {});
  const FitResult& fit = s.candidates[s.recommended].fit;
  CHECK(law_name(fit.config.law.value()) == "linear-1");
  test::check_intervals(fit, std::numeric_limits<double>::infinity());
}
