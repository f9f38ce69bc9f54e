// Recordings with more than 20,000 samples: starts come from a thinned copy, intervals from the
// covariance, and every copy of the data has to hold.
#include <catch2/catch.hpp>
#include <cmath>

#include "support/one_law.hpp"
#include "support/remarks.hpp"
#include "tpm/base/random.hpp"
#include "tpm/fit/design/recovery.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;

namespace {

// linear-1, SI: k_inf, k1, tau1 and offset are estimated, the contact lies at depth 0
const std::vector<double> kTrueEstimates{80.0, 120.0, 3.0, 0.004};
const std::vector<double> kLaw{80.0, 120.0, 3.0, 0.0, 0.004};
constexpr std::size_t kKept = 12;  // one sample in so many stays in the thinned record

/// Ramp and hold at even times, 24,000 samples or so, with 1 % of the peak as normal noise.
Recording long_recording() {
  SimulatedTest test;
  test.ramp_interval_s = test.hold_interval_s = 21.1 / 24'000.0;
  Recording r = simulated_recording(parse_law_name("linear-1", "test"), kLaw, test);
  double peak = 0.0;
  for (const double force : r.response) peak = std::max(peak, force);
  Random random(11);
  for (double& force : r.response) force += 0.01 * peak * random.normal();
  return r;
}

Recording every_kept(const Recording& r) {
  Recording few = r;
  few.time_s.clear();
  few.drive.clear();
  few.response.clear();
  for (std::size_t i = 0; i < r.time_s.size(); i += kKept) {
    few.time_s.push_back(r.time_s[i]);
    few.drive.push_back(r.drive[i]);
    few.response.push_back(r.response[i]);
  }
  return few;
}

const std::vector<PreparedRecording>& whole_record() {
  static const std::vector<PreparedRecording> one{prepare_recording("long", long_recording())};
  return one;
}

/// The thinned record with the phases of the whole one, so that both fit the same window.
std::vector<PreparedRecording> thinned_record() {
  PreparedRecording few = whole_record().front();
  few.recording = every_kept(few.recording);
  return {few};
}

FitResult fit_of_record(const std::vector<PreparedRecording>& record, const FitConfig& config) {
  return run_fit(config, data_sets(record));
}

/// With the contact at its true depth instead of where it was found.
FitConfig config_for(const std::vector<PreparedRecording>& record) {
  SetupOptions options;
  options.nuisance = Nuisance::offset;
  options.measured = false;  // the phases are those of the whole record, also of the thinned one
  FitConfig config = recording_config(parse_law_name("linear-1", "test"), record, options);
  config.fixed[3] = 0.0;
  return config;
}

void check_true_values(const FitResult& fit) {
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const ParameterResult& p = fit.parameters[i];
    CAPTURE(p.parameter.name, p.estimate, kTrueEstimates[i]);
    REQUIRE(p.lower);
    REQUIRE(p.upper);
    CHECK(*p.lower < kTrueEstimates[i]);
    CHECK(kTrueEstimates[i] < *p.upper);
  }
}

}  // namespace

TEST_CASE("24,000 samples give the true values, and what every twelfth of them gives") {
  const FitResult fit = fit_of_record(whole_record(), config_for(whole_record()));
  const FitResult few = fit_of_record(thinned_record(), config_for(thinned_record()));
  REQUIRE(fit.value_count > 20'000);
  REQUIRE(few.value_count < 20'000);
  CHECK(test::has_remark(fit.remarks, "intervals_from_covariance"));
  check_true_values(fit);
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const ParameterResult& p = fit.parameters[i];
    const ParameterResult& q = few.parameters[i];
    CAPTURE(p.parameter.name, p.estimate, q.estimate);
    // What the twelfth adds by itself has the variance of the difference (nested samples).
    const double apart = std::sqrt(std::pow(*q.standard_error, 2) - std::pow(*p.standard_error, 2));
    CHECK(std::abs(p.estimate - q.estimate) < 3.0 * apart);
    CHECK_THAT(*q.standard_error / *p.standard_error, WithinRel(std::sqrt(double{kKept}), 0.1));
  }
}

TEST_CASE("24,000 samples without noise give back the parameters that made them") {
  std::vector<PreparedRecording> record = whole_record();
  SimulatedTest test;
  test.ramp_interval_s = test.hold_interval_s = 21.1 / 24'000.0;
  record.front().recording.response =
      simulated_recording(parse_law_name("linear-1", "test"), kLaw, test).response;
  const FitResult fit = fit_of_record(record, config_for(record));
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    CAPTURE(fit.parameters[i].parameter.name);
    CHECK(std::abs(fit.parameters[i].estimate - kTrueEstimates[i]) <
          1e-6 * std::abs(kTrueEstimates[i]) + 1e-12);
  }
}

TEST_CASE("a long recording goes through select and the prediction of its second half") {
  const Selection s = select_law(whole_record(), test::only({"linear-1"}));
  const Candidate& chosen = s.candidates[s.recommended];
  CHECK(s.samples > 20'000);
  REQUIRE(chosen.held_out.size() == 1);
  CHECK(chosen.held_out.front().rms < 1.2 * chosen.held_out.front().rms_if_fitted);
  CHECK_THAT(chosen.rms_over_peak, WithinRel(0.01, 0.05));
}

TEST_CASE("a long recording with the size of its noise among the parameters") {
  // Two residuals for each reading.
  Json document = config_json(config_for(whole_record()));
  document["data"][0]["noise"] = {{"kind", "absolute"}, {"absolute", "estimated"}};
  document["starts"]["count"] = 2;
  const FitResult fit = fit_of_record(whole_record(), parse_fit_config(document, "test"));
  REQUIRE(fit.parameters.size() == kTrueEstimates.size() + 1);
  REQUIRE(fit.parameters.back().parameter.name == "sigma_a");
  CHECK_THAT(fit.parameters.back().estimate, WithinRel(fit.recordings.front().rms_residual, 1e-3));
  for (std::size_t i = 0; i < kTrueEstimates.size(); ++i) {
    const ParameterResult& p = fit.parameters[i];
    CAPTURE(p.parameter.name, p.estimate, kTrueEstimates[i]);
    CHECK(std::abs(p.estimate - kTrueEstimates[i]) < 3.0 * *p.standard_error);
  }
}
