// Steps and staircases that the samples do not resolve, at more places than the fast test takes.
#include "driven_solid.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::fit;
using Catch::Matchers::WithinRel;
using test::check_truth;
using test::driven;
using test::steps;

TEST_CASE("steps between two samples bias no interval, wherever they lie", "[rise]") {
  const double begin = GENERATE(5.001, 5.015, 5.022);
  const PreparedRecording one =
      prepare_recording("step.csv", driven(steps({begin}, 4e-3, 40.0), 35.0, 5));
  const std::vector<UnseenRise> rises = unseen_rises(one);
  REQUIRE(rises.size() == 1);
  CHECK_THAT(rises.front().begin_s, WithinRel(5.0, 1e-12));
  const Selection s = select_law(std::span(&one, 1), {});
  const FitResult& fit = s.candidates[s.recommended].fit;
  CHECK(law_name(fit.config.law.value()) == "linear-1");
  check_truth(fit, 1.4);
}

TEST_CASE("steps of other staircases between samples have delays of their own", "[rise]") {
  const std::uint64_t seed = GENERATE(2, 3);
  Random random(seed);
  std::vector<double> begins;
  for (int i = 0; i < 4; ++i) begins.push_back(5.0 + 8.0 * i + 0.03 * random.uniform());
  const PreparedRecording one =
      prepare_recording("stairs.csv", driven(steps(begins, 1e-3, 60.0), 45.0, seed));
  CHECK(unseen_rises(one).size() == 4);
  const Selection s = select_law(std::span(&one, 1), {});
  check_truth(s.candidates[s.recommended].fit, 1.4);
}
