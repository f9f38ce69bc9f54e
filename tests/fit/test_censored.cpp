// The likelihood of readings at a limit of the force cell.
#include <catch2/catch.hpp>
#include <cmath>

#include "adequacy_studies.hpp"
#include "tpm/fit/likelihood/noise.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double kOpen = std::numeric_limits<double>::infinity();

double minus_two_log(double z) {
  const double r = censored_residual(1.0, 1.0, 0.0, kOpen, z).r;
  return r * r;
}

}  // namespace

TEST_CASE("a censored reading counts the probability of its side", "[censored]") {
  CHECK_THAT(minus_two_log(0.0), WithinRel(2.0 * std::log(2.0), 1e-12));
  CHECK_THAT(minus_two_log(1.0), WithinRel(-2.0 * std::log(0.8413447460685429), 1e-12));
  // ln Phi(-26) and ln Phi(-30), mpmath 1.3 with 15 digits.
  CHECK_THAT(minus_two_log(-26.0), WithinRel(2.0 * 342.178508929928, 1e-7));
  CHECK_THAT(minus_two_log(-30.0), WithinRel(2.0 * 454.321243956343, 1e-7));
  CHECK(censored_residual(1.0, 1.0, 0.0, kOpen, 9.0).r == 0.0);
  CHECK(censored_residual(kOpen, 1.0, 0.0, kOpen, -9.0).r == 0.0);
}

TEST_CASE("its derivative is that of its value, on both sides and in any noise", "[censored]") {
  constexpr double kStep = 1e-5;
  for (const bool above : {true, false}) {
    const double lower = above ? 3.0 : -kOpen, upper = above ? kOpen : 3.0;
    for (const double f : {-60.0, -10.0, 1.0, 2.5, 3.0, 3.7, 6.0, 20.0}) {
      const auto at = [&](double x) { return censored_residual(2.0, 0.7, lower, upper, x); };
      const double slope = (at(f + kStep).r - at(f - kStep).r) / (2.0 * kStep);
      CAPTURE(above, f);
      CHECK_THAT(at(f).d_r, WithinAbs(slope, 1e-6));
      CHECK((above ? at(f).r <= 0.0 : at(f).r >= 0.0));
    }
  }
}

TEST_CASE("far beyond the limit a censored reading asks nothing, far inside it is a reading",
          "[censored]") {
  const DatumResidual inside = censored_residual(2.0, 0.5, 3.0, kOpen, -97.0);
  CHECK_THAT(inside.r, WithinRel((-97.0 - 3.0) / 2.0, 2e-3));
  CHECK_THAT(inside.d_r, WithinRel(1.0 / 2.0, 2e-3));
}

TEST_CASE("a hold that is clipped all the way bounds the stiffness from below", "[censored]") {
  // The force relaxes to 68 % of its peak; at 62 % the ramp alone is left, and that the force stays
  // above the limit.
  test::AdequacyTrial trial;
  trial.at_rest = 40;
  trial.clip = 0.62;
  int missing = 0, intervals = 0;
  for (int i = 0; i < 12; ++i) {
    trial.seed = 900 + static_cast<std::uint64_t>(i);
    const test::AdequacyOutcome o = test::fitted(trial, true);
    CHECK(o.clipped);
    missing += o.missing;
    intervals += o.intervals;
  }
  INFO(missing << " of " << intervals);
  CHECK(missing <= 3);
}
