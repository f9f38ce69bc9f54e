// tpm validate: the zero and its drift, signs and units of the readings, and what an instrument
// adds.
#include <catch2/catch.hpp>
#include <cmath>

#include "quiet_recordings.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/fit/select/file_remarks.hpp"

namespace tpm::fit {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::quiet_law;
using test::quiet_recording;
using test::request_for;

TEST_CASE("a drift of the zero that the rest tells is no model error", "[validate]") {
  const LawFile law = quiet_law();
  const test::StudyNoise noise;  // 2 mN
  const auto with_drift = [&](double per_s, std::uint64_t seed) {
    Random random(seed);
    Recording r = test::study_recording(test::study_validation(200, 0.0), noise, random);
    for (std::size_t i = 0; i < r.time_s.size(); ++i) r.response[i] += per_s * r.time_s[i];
    return prepare_recording("drifting", std::move(r));
  };
  int covered = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Validation v = validate(request_for(law, with_drift(1e-3, seed)));
    const RecordingComparison& r = v.recordings.front();
    REQUIRE(r.placement.drift);
    CHECK_THAT(r.placement.drift->per_s, WithinAbs(1e-3, 4.0 * r.placement.drift->u_per_s));
    const QuantityComparison& q = test::study_quantity(r, QuantityKind::end_of_hold);
    // By hand: u of the slope times the time from the middle of the rest to the middle of the last
    // tenth of the hold.
    const auto part = std::ranges::find(q.parts, "the drift of the zero", &UncertaintyPart::name);
    REQUIRE(part != q.parts.end());
    const double lever_s = 19.9 + 0.75 + 19.0 - r.placement.drift->origin_s;
    CHECK_THAT(part->u, WithinRel(r.placement.drift->u_per_s * lever_s, 0.02));
    covered += std::abs(q.e.error) <= q.e.expanded();
    if (seed == 1) {
      CHECK_THAT(to_terminal_text(v), Contains("taken out"));
      CHECK(to_json(v).at("recordings").at(0).at("placement").contains("zero_drift_per_s"));
    }
  }
  CHECK(covered >= 17);  // fewer of 20 at 95 %: one run in 40
  CHECK_FALSE(validate(request_for(law, with_drift(0.0, 2))).recordings.front().placement.drift);
}

TEST_CASE("a force in the wrong unit is a model error with a hint", "[validate]") {
  const LawFile law = quiet_law();
  PreparedRecording wrong = quiet_recording(1.0);
  for (double& f : wrong.recording.response) f *= 1e3;
  const Validation v = validate(request_for(law, wrong));
  CHECK(v.verdict == ModelVerdict::seen);
  CHECK_THAT(to_terminal_text(v), Contains("1e+03 times S") && Contains("units"));
  CHECK(validate(request_for(law, quiet_recording(1.5))).remarks.empty());
}

TEST_CASE("a force that is counted negative is refused, not called a model error", "[validate]") {
  PreparedRecording turned = quiet_recording(1.0);
  for (double& f : turned.recording.response) f = -f;
  turned = prepare_recording("turned.csv", turned.recording);
  const LawFile law = quiet_law();
  CHECK_THAT(test::refusal_of([&] { (void)validate(request_for(law, turned)); }),
             Contains("--negate-response"));
}

TEST_CASE("the whole curve expects what the instrument may be off by", "[validate]") {
  const LawFile law = quiet_law();
  ValidationRequest request = request_for(law, quiet_recording(1.0));
  const double without = validate(request).recordings.front().curve.mean_square_u;
  Instrument cell;
  cell.id = "cell";
  cell.force = ChannelUncertainty{0.01, 0.0};
  request.instruments = {cell};
  const RecordingComparison r = validate(request).recordings.front();
  // 1 % of the readings: D's part alone, for the calibration's instrument is not stated.
  double square = 0.0;
  std::size_t count = 0;
  const std::vector<double>& f = request.recordings.front().recording.response;
  for (std::size_t i = r.parts.ramp_first; i <= *r.parts.hold_last; ++i, ++count) {
    square += std::pow(0.01 * (f[i] - r.placement.zero), 2);
  }
  CHECK_THAT(r.curve.mean_square_u - without, WithinRel(square / static_cast<double>(count), 1e-6));
}

TEST_CASE("an instrument is stated once, and fits and budgets take it", "[validate]") {
  const test::TempFolder folder;
  write_file(folder / "r.json",
             R"j({"instrument": {"id": "cell", "force": "1 % of reading (standard)",
                 "depth": "20 um (standard)", "zero": "3 mN (standard)", "resolution": "12 mN",
                 "noise": "0.1 mN"}})j");
  PreparedRecording recording = quiet_recording(1.0);
  take_instrument(recording, folder / "r.csv");
  REQUIRE(recording.instrument);
  CHECK_THAT(recording.instrument->reading_floor(), WithinRel(0.012 / std::sqrt(12.0), 1e-12));
  REQUIRE_FALSE(recording.remarks.empty());
  CHECK(recording.remarks.back().code == "gain_not_in_intervals");
  // No reading is known better than its step.
  CHECK_THAT(scatter_of(recording, parts_of(recording)).sigma,
             WithinRel(0.012 / std::sqrt(12.0), 1e-12));
  // The budget at the end of the ramp: 1 % of 300 mN, 3 mN, and 20 um of 105 N/m.
  LawFile law = quiet_law();
  law.values = {60.0, 45.0, 2.0, 0.0, 0.0};
  const ErrorBudget budget = contact_budget(law, recording, {});
  REQUIRE(budget.instrument);
  const double peak = budget.peak_N;
  const double u = std::hypot(0.01 * peak, 3e-3, 20e-6 * 105.0);
  CHECK_THAT(budget.instrument->largest, WithinRel(1.959964 * u / peak, 0.03));
  CHECK(budget.data_part >= budget.instrument->largest);
  CHECK_THAT(to_terminal_text(budget), Contains("instrument cell, 95 %"));
  ErrorBudget weak = budget;
  weak.peak_N = 2.02e-4;
  CHECK_THAT(to_terminal_text(weak), Contains("peak 202 uN; in % of it"));
}

TEST_CASE("without readings before contact a fit's zero is what the instrument states",
          "[validate]") {
  PreparedRecording recording = prepare_recording("cut", test::study_recording_without_rest());
  recording.instrument = Instrument{};
  recording.instrument->id = "cell";
  recording.instrument->zero = 1.5e-3;
  const FitConfig config = recording_config(test::study_law(), {&recording, 1}, {});
  const auto zero = std::ranges::find_if(
      config.parameters, [](const EstimatedParameter& p) { return p.fit.name == "offset"; });
  REQUIRE(zero != config.parameters.end());
  REQUIRE(zero->prior);
  CHECK(zero->prior->sd == 1.5e-3);
  CHECK_FALSE(zero->prior->measured);
  CHECK_THAT(zero->prior->from, Contains("instrument cell"));
}

}  // namespace tpm::fit
