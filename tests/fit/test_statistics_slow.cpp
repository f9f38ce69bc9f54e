// Statistics checked by simulation: how often intervals hold the true value under correlated and
// heavy-tailed noise, and whether the block bootstrap sees correlation.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "statistics_problems.hpp"
#include "tpm/fit/design/coverage.hpp"
#include "tpm/fit/likelihood/correlation.hpp"

using namespace tpm;
using namespace tpm::fit;
using namespace tpm::test;
using Catch::Matchers::WithinRel;

namespace {

const std::vector<double> kLine{1.0, 2.0};
const std::vector<double> kDecay{3.0, 2.0};

Minimum fit_line(const CurveData& data) {
  const CurveResiduals function(straight_line, data);
  return minimise(function, line_parameters(), std::vector<double>{0.0, 0.0});
}

Correlation correlation_of(const CurveData& data, const Minimum& m) {
  return residual_correlation(CurveRefit(straight_line, data, 1).standardised_residuals(m.natural));
}

/// Printed by the test program's option -s.
void print(const std::string& what, int covered, int sets) {
  SUCCEED(fmt::format("{}: {:.2f} % of {}", what, 100.0 * covered / sets, sets));
}

/// How many 95 % intervals of the slope hold it, with and without regard to correlation.
struct SlopeCoverage {
  int naive = 0, inflated = 0;
};

SlopeCoverage slope_coverage(std::size_t n, double phi, int sets, std::uint64_t seed) {
  Random random(seed);
  SlopeCoverage covered;
  for (int set = 0; set < sets; ++set) {
    const CurveData data =
        curve_data(straight_line, kLine, 1.0, 0.1, autoregression(n, phi, random));
    const CurveResiduals function(straight_line, data);
    const Minimum m = fit_line(data);
    Threshold threshold{0.95, false, static_cast<int>(n), 2};
    const auto holds = [&] {
      const Covariance c = linear_covariance(function, line_parameters(), m, threshold);
      const double variance = threshold.inflation * threshold.variance_factor(m.deviance);
      const double t = std::sqrt(threshold.rise(m.deviance) / variance);
      return std::abs(m.natural[1] - kLine[1]) <= t * c.theta_sd[1];
    };
    if (holds()) ++covered.naive;
    threshold.inflation = correlation_of(data, m).inflation();
    if (holds()) ++covered.inflated;
  }
  return covered;
}

/// How many 95 % profile intervals of the decay time hold it.
int decay_coverage(const ErrorLaw& law, int sets, std::uint64_t seed) {
  Random random(seed);
  int covered = 0;
  for (int set = 0; set < sets; ++set) {
    std::vector<double> errors(60);
    for (double& e : errors) e = draw_error(law, random);
    CurveData data = curve_data(decay, kDecay, 8.0, 0.05, errors);
    data.law = law;
    const CurveResiduals function(decay, data);
    const Minimum m = minimise(function, decay_parameters(), kDecay);
    const Threshold threshold{0.95, true, 60, 2};
    const Covariance c = linear_covariance(function, decay_parameters(), m, threshold);
    Profile p = profile_likelihood(function, decay_parameters(), {&m, 1}, 1, c, threshold);
    if (p.better) {
      const Minimum deeper = minimise(function, decay_parameters(), p.better->natural);
      p = profile_likelihood(function, decay_parameters(), {&deeper, 1}, 1, c, threshold);
    }
    if (p.lower && p.upper && *p.lower <= kDecay[1] && kDecay[1] <= *p.upper) ++covered;
  }
  return covered;
}

}  // namespace

TEST_CASE(
    "correlated noise: intervals that ignore it are far too short, inflated ones nearly hold") {
  constexpr int kSets = 2000;
  const SlopeCoverage dense = slope_coverage(500, 0.8, kSets, 1);
  print("n 500, phi 0.8, ignored", dense.naive, kSets);
  print("n 500, phi 0.8, inflated", dense.inflated, kSets);
  CHECK(dense.naive < 0.6 * kSets);
  CHECK(dense.inflated > 0.9 * kSets);
  const SlopeCoverage sparse = slope_coverage(60, 0.5, kSets, 2);
  print("n 60, phi 0.5, ignored", sparse.naive, kSets);
  print("n 60, phi 0.5, inflated", sparse.inflated, kSets);
  CHECK(sparse.naive < 0.8 * kSets);
  CHECK(sparse.inflated > 0.83 * kSets);
}

TEST_CASE("independent noise keeps its calibration with the correlation looked at") {
  constexpr int kSets = 4000;
  const SlopeCoverage c = slope_coverage(60, 0.0, kSets, 3);
  print("n 60, independent, ignored", c.naive, kSets);
  print("n 60, independent, inflated", c.inflated, kSets);
  CHECK(binomial_test(c.naive, kSets, 0.95) > 0.001);
  CHECK(binomial_test(c.inflated, kSets, 0.95) > 0.001);
}

TEST_CASE("profile intervals under Student's t and Laplace noise hold the true value") {
  constexpr int kSets = 1000;
  const int student = decay_coverage({ErrorShape::student_t, ErrorScale::linear, 4.0}, kSets, 4);
  print("Student's t, 4 degrees of freedom", student, kSets);
  CHECK(binomial_test(student, kSets, 0.95) > 0.001);
  const int laplace = decay_coverage({ErrorShape::laplace, ErrorScale::linear, 4.0}, kSets, 5);
  print("Laplace", laplace, kSets);
  CHECK(binomial_test(laplace, kSets, 0.95) > 0.001);
}

TEST_CASE("the block bootstrap sees correlation that the residual bootstrap does not") {
  Random random(6);
  constexpr int kSets = 400;
  double squares = 0.0;
  for (int set = 0; set < kSets; ++set) {
    const Minimum m =
        fit_line(curve_data(straight_line, kLine, 1.0, 0.1, autoregression(400, 0.6, random)));
    squares += (m.natural[1] - kLine[1]) * (m.natural[1] - kLine[1]) / kSets;
  }
  const double true_sd = std::sqrt(squares);
  double blocks = 0.0;
  double single = 0.0;
  constexpr int kBootstraps = 12;
  for (int set = 0; set < kBootstraps; ++set) {
    const CurveData data =
        curve_data(straight_line, kLine, 1.0, 0.1, autoregression(400, 0.6, random));
    const Minimum m = fit_line(data);
    BootstrapOptions options;
    options.replicates = 200;
    options.seed = static_cast<std::uint64_t>(set);
    const CurveRefit refit(straight_line, data, 1);
    single += bootstrap(refit, line_parameters(), m, options).parameters[1].standard_error;
    options.resampling = Resampling::blocks;
    blocks += bootstrap(refit, line_parameters(), m, options).parameters[1].standard_error;
  }
  SUCCEED(fmt::format("SE of slope: simulated {:.4f}, blocks {:.4f}, residuals {:.4f}", true_sd,
                      blocks / kBootstraps, single / kBootstraps));
  CHECK_THAT(blocks / kBootstraps, WithinRel(true_sd, 0.2));
  CHECK(single / kBootstraps < 0.6 * true_sd);
}
