// What follows a step before a law describes it: ringing, and sensors that follow late.
#include <catch2/catch.hpp>
#include <cmath>

#include "creep_recordings.hpp"
#include "placed_recordings.hpp"
#include "tpm/fit/select/selection.hpp"

using namespace tpm;
using namespace tpm::fit;
using Catch::Matchers::Contains;
using tpm::test::CreepTrial;
using tpm::test::PlacedTest;

TEST_CASE("the samples after a step are left out, as long as they ring", "[placement]") {
  PlacedTest test;
  test.rest_s = 5.0;
  test.ramp_s = 0.05;  // one sample
  test.start_m = -0.1e-3;
  Random random(13);
  Recording r = test::measured(test, test::placed(test), random);
  const PreparedRecording step = prepare_recording("step.csv", r);
  CHECK(step.from_s > 5.1);
  CHECK(step.from_s < 5.4);
  CHECK_THAT(step.start_up, Contains("after the step are left out"));
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const double since = r.time_s[i] - 5.05;
    if (since >= 0.0) r.response[i] += 0.05 * std::exp(-since / 0.3) * std::cos(40.0 * since);
  }
  const PreparedRecording ringing = prepare_recording("ringing.csv", r);
  CHECK(ringing.from_s > 5.8);
  CHECK_THAT(ringing.start_up, Contains("they ring"));
  PlacedTest ramp;
  CHECK(test::prepared(ramp, 3).start_up.empty());
}

TEST_CASE("a fit ends before a later step after which readings ring", "[placement]") {
  PlacedTest test;
  test.rest_s = 5.0;
  test.ramp_s = 0.05;  // one sample
  test.hold_s = 20.0;
  test.start_m = -0.1e-3;
  Random random(13);
  const Recording first = test::measured(test, test::placed(test), random);
  const double again_s = 20.0;
  const auto twice = [&](bool rings) {
    Recording r = first;
    for (std::size_t i = 0; i < r.time_s.size(); ++i) {
      const double since = r.time_s[i] - again_s;
      if (since <= 0.0) continue;
      r.drive[i] += 1e-3;
      r.response[i] += 0.1;
      if (rings) r.response[i] += 0.05 * std::exp(-since / 0.3) * std::cos(40.0 * since);
    }
    return prepare_recording("steps.csv", r);
  };
  const PreparedRecording quiet = twice(false), ringing = twice(true);
  CHECK_THAT(ringing.start_up, Contains("the fit ends before the step at 20"));
  CHECK(ringing.to_s <= again_s);
  CHECK_THAT(quiet.start_up, !Contains("the fit ends before"));
  CHECK(quiet.to_s > again_s);
}

TEST_CASE("the rest before a step that was not sampled tells the zero", "[placement]") {
  // 2 kPa beside 3 kPa that relax in 5 s: a step of the strain, or of the stress.
  const bool creeps = GENERATE(false, true);
  CreepTrial trial{.rest_s = 4.05, .ramp_s = 0.04, .noise = 2e-5, .strain_zero = 1.5e-3};
  Recording r = test::creep_recording_of(trial);
  Random random(19);
  for (std::size_t i = 0; i < r.time_s.size() && !creeps; ++i) {
    const double since = r.time_s[i] - 4.07;
    r.drive[i] = since > 0.0 ? 0.02 : 0.0;
    r.response[i] = 3.0 + 0.1 * random.normal();
    if (since > 0.0) r.response[i] += 0.02 * (2000.0 + 3000.0 * std::exp(-since / 5.0));
  }
  const std::vector<PreparedRecording> one{prepare_recording("step.csv", r)};
  REQUIRE(one.front().load_imposed == creeps);
  REQUIRE(one.front().from_s > 4.1);
  const auto before = level_before_load(one.front());
  REQUIRE(before);
  CHECK(before->samples >= 40);
  CHECK_THAT(before->level.value,
             Catch::Matchers::WithinAbs(creeps ? 1.5e-3 : 3.0, 4.0 * before->level.sd));
  const Selection s = select_law(one, {});
  const FitResult& fit = s.candidates[s.recommended].fit;
  CHECK(law_name(fit.config.law.value()) == "linear-1");
  for (const ParameterResult& p : fit.parameters) {
    const double truth = p.parameter.name == "k_inf"  ? 2000.0
                         : p.parameter.name == "k1"   ? 3000.0
                         : p.parameter.name == "tau1" ? 5.0
                                                      : 0.0;
    if (truth == 0.0) continue;
    INFO(p.summary);
    CHECK(p.lower.value() < truth);
    CHECK(p.upper.value() > truth);
    CHECK(*p.upper - *p.lower < 0.2 * truth);
  }
}

TEST_CASE("a drift of the zero after a step is no start-up", "[placement]") {
  PlacedTest test;
  test.rest_s = 5.0;
  test.ramp_s = 0.05;
  Random random(31);
  Recording r = test::measured(test, test::placed(test), random);
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const bool held = r.time_s[i] > 5.05;
    r.response[i] = (held ? 0.2 : 0.0) + 5e-3 * r.time_s[i] + 1e-3 * random.normal();
  }
  CHECK_THAT(prepare_recording("drift.csv", r).start_up, !Contains("they rise"));
}

TEST_CASE("a drive that overshoots before it is held is fitted to the end of the hold",
          "[placement]") {
  PlacedTest test;
  Recording r = test::placed(test);
  const double end_s = test.rest_s + test.ramp_s;
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    const double since = r.time_s[i] - end_s;
    if (since > 0.0) r.drive[i] += 3e-4 * std::exp(-since / 0.2) * std::sin(20.0 * since);
  }
  const LawSpec spec = test::spec_of(test);
  std::vector<double> values = test.material;
  values.resize(law_parameters(spec).size(), 0.0);
  Protocol history = measured_history(Drive::displacement, r.time_s, r.drive);
  history.set_equilibrium_at_start(true);
  const Eigen::VectorXd force =
      LawModel(spec).respond(history, r.time_s, values, Want::values).value;
  Random random(17);
  for (std::size_t i = 0; i < r.response.size(); ++i) {
    r.response[i] = force[static_cast<Eigen::Index>(i)] + test.noise_N * random.normal();
  }
  const PreparedRecording recording = prepare_recording("overshoot.csv", r);
  CHECK(recording.to_s == r.time_s.back());
  // A drive that falls further is unloaded, and so is one that never stops to fall.
  for (std::size_t i = 0; i < r.time_s.size(); ++i) {
    if (r.time_s[i] > end_s + 5.0) r.drive[i] = 3e-3;
  }
  CHECK(prepare_recording("unloaded.csv", r).to_s < end_s + 6.0);
}
