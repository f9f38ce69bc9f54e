// Confidence intervals checked by simulation: 2,000 data sets each, coverage against 95 % by an
// exact binomial test at the 0.1 % level, no bound near.
#include <catch2/catch.hpp>

#include "tpm/fit/design/coverage.hpp"

using namespace tpm;
using namespace tpm::fit;

namespace {

FitConfig calibration() {
  return read_fit_config(std::string(TPM_TEST_SOURCE_DIR) + "/configs/coverage_absolute.json");
}

void require_calibrated(const FitConfig& config) {
  const CoverageResult result = check_coverage(config, 2000, 20130707);
  INFO(to_terminal_text(result));
  CHECK(result.failed == 0);
  for (const ParameterCoverage& p : result.parameters) {
    CHECK(p.one_sided == 0);
    CHECK(p.p_value > 0.001);
  }
}

}  // namespace

TEST_CASE("profile intervals hold the true value as often as they say: known absolute noise") {
  require_calibrated(calibration());
}

TEST_CASE(
    "profile intervals hold the true value as often as they say: estimated noise, F thresholds") {
  FitConfig config = calibration();
  config.data[0].noise.scale_known = false;
  require_calibrated(config);
}

TEST_CASE("profile intervals hold the true value as often as they say: log-normal noise") {
  FitConfig config = calibration();
  config.data[0].noise = {NoiseKind::log, 0.0, 0.01, true};
  require_calibrated(config);
}

TEST_CASE("an interval that is too narrow is caught") {
  // The same intervals, presented as 99 % ones: the test must be able to fail.
  const CoverageResult result = check_coverage(calibration(), 2000, 1);
  CHECK(binomial_test(result.parameters[0].covered, result.sets, 0.99) < 0.001);
}

TEST_CASE("the binomial test is exact") {
  // Binomial(10, 1/2): P(0 or 10) = 2/1024, P(<= 1 or >= 9) = 22/1024
  CHECK(binomial_test(0, 10, 0.5) == Approx(2.0 / 1024).epsilon(1e-12));
  CHECK(binomial_test(9, 10, 0.5) == Approx(22.0 / 1024).epsilon(1e-12));
  CHECK(binomial_test(5, 10, 0.5) == Approx(1.0).epsilon(1e-12));
}
