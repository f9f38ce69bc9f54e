// tpm validate on creep: depth under a load, with a law that was fitted to relaxation; and as
// tables have it, stress and strain, the stress imposed, with laws that were fitted to creep.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "creep_recordings.hpp"
#include "quiet_recordings.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "validation_studies.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::creep_recording;
using test::CreepTrial;
using test::quiet_law;
using test::request_for;

PreparedRecording stiffened_creep(const CreepTrial& trial, double stiffer = 1.0) {
  Recording r = test::creep_recording_of(trial);
  for (double& strain : r.drive) strain /= stiffer;
  r.header.sha256 = std::string(64, static_cast<char>('a' + trial.seed % 20));
  return prepare_recording("creep" + std::to_string(trial.seed) + ".csv", std::move(r));
}

/// Fitted to 100 Pa within 2 s.
ValidationRequest request_with(PreparedRecording recording) {
  const std::vector<PreparedRecording> calibration{stiffened_creep({.rest_s = 4.0})};
  SetupOptions setup;
  setup.starts = 4;
  setup.profiles = false;
  ValidationRequest request;
  request.law_file = "law.json";
  request.law =
      fitted_law(run_fit(recording_config(parse_law_name("linear-1", "test"), calibration, setup),
                         data_sets(calibration)));
  request.calibration.files.push_back(
      {"creep23.csv", calibration.front().recording.header.sha256, calibration.front(), ""});
  request.recordings = {std::move(recording)};
  return request;
}

const CreepTrial kFaster{.rest_s = 4.0, .ramp_s = 1.0, .stress_Pa = 60.0, .noise = 3e-4, .seed = 7};

}  // namespace

TEST_CASE("creep has depth, ratio, half time and rate of the curve", "[validate]") {
  // Depth 1 mm + 0.1 mm/s (t - corner) on a load that ends its ramp at 5 s.
  PreparedRecording r = creep_recording(quiet_law(), 1.0, 4);
  Eigen::VectorXd curve(501);
  for (int i = 0; i <= 500; ++i) curve[i] = 1e-3 + 1e-4 * std::max(0.05 * i - 5.0, 0.0);
  const RecordingParts parts = parts_of(r);
  REQUIRE(parts.has_hold());
  CHECK_THAT(parts.corner_s, WithinAbs(5.0, 1e-9));
  const auto read = [&](QuantityKind kind) {
    return read_quantity({kind}, parts, r.recording, 0.0, curve).value().value;
  };
  CHECK_THAT(read(QuantityKind::peak), WithinRel(1e-3, 1e-9));
  CHECK_THAT(read(QuantityKind::rate), WithinRel(1e-4, 1e-9));
  const double end = 1e-3 + 1e-4 * 19.0;  // mean of the last 2 s of 20 s
  CHECK_THAT(read(QuantityKind::end_of_hold), WithinRel(end, 1e-9));
  CHECK_THAT(read(QuantityKind::half_time), WithinRel(9.5, 1e-6));
  CHECK(quantity_words({QuantityKind::peak}, Quantity::load, Quantity::indentation_depth) ==
        "depth at the corner");
}

TEST_CASE("creep of the same material is as predicted, of a stiffer one it is not", "[validate]") {
  const LawFile law = quiet_law();
  const Validation same = validate(request_for(law, creep_recording(law, 1.0, 5)));
  INFO(to_terminal_text(same));
  CHECK(same.verdict == ModelVerdict::not_seen);
  CHECK(same.recordings.front().creep);
  CHECK(same.recordings.front().quantities.size() == 5);
  ValidationRequest stiff = request_for(law, creep_recording(law, 1.1, 6));
  stiff.requirement = parse_requirement("0.4 mm", "test");
  const Validation other = validate(stiff);
  const QuantityComparison& end =
      test::study_quantity(other.recordings.front(), QuantityKind::end_of_hold);
  // S = 0.1 N / 60 N/m, D that over 1.1.
  CHECK_THAT(end.e.error, WithinAbs((0.1 / 60.0) * (1.0 - 1.0 / 1.1), 3.0 * end.e.u_val + 1e-6));
  CHECK(end.verdict == ModelVerdict::adequate);
  CHECK(validate(request_for(law, creep_recording(law, 1.1, 6))).verdict == ModelVerdict::seen);
}

TEST_CASE("creep in a table of stress and strain is validated with a law of creep",
          "[validate][creep]") {
  const PreparedRecording same = stiffened_creep(kFaster);
  REQUIRE(same.load_imposed);
  const Validation v = validate(request_with(same));
  const std::string text = to_terminal_text(v);
  INFO(text);
  CHECK(v.verdict == ModelVerdict::not_seen);
  const RecordingComparison& r = v.recordings.front();
  CHECK(r.creep);
  CHECK_FALSE(r.calibration);
  CHECK(r.quantities.size() == 5);
  CHECK_THAT(text, Contains("strain at the corner") && Contains("load 0") &&
                       Contains("no model error is seen"));
  // S at the end of the hold is the closed form, within the law's own uncertainty.
  double sum = 0.0;
  int count = 0;
  for (int i = 0; i <= 340; ++i) {
    if (0.1 * i < 34.0 - 2.9 - 1e-9) continue;  // the last tenth of 29 s
    sum += test::creep_strain(kFaster, 0.1 * i);
    ++count;
  }
  const QuantityComparison& end = test::study_quantity(r, QuantityKind::end_of_hold);
  CHECK_THAT(end.simulated, WithinAbs(sum / count, 3.0 * end.u_input + 1e-4 * end.simulated));
  CHECK_THAT(end.measured, WithinAbs(sum / count, 3.0 * end.u_D + 1e-4 * end.simulated));
  CHECK_THAT(part_words(r, v.spec),
             Contains("to 0.06 kPa") && Contains("hold to 34 s") && Contains("the whole loading"));
  const std::string verdict(verdict_key(v.verdict));
  CHECK_THAT(to_csv(v), Contains("\ncreep7.csv,all quantities,") && Contains("," + verdict + ","));
}

TEST_CASE("a stiffer material is seen in creep, and fitted creep gets no verdict",
          "[validate][creep]") {
  ValidationRequest request = request_with(stiffened_creep(kFaster, 1.1));
  request.requirement = parse_requirement("5%", "test");
  const Validation stiffer = validate(request);
  INFO(to_terminal_text(stiffer));
  CHECK(stiffer.verdict == ModelVerdict::not_adequate);
  const QuantityComparison& end =
      test::study_quantity(stiffer.recordings.front(), QuantityKind::end_of_hold);
  CHECK_THAT(end.e.error, WithinAbs(end.simulated * (1.0 - 1.0 / 1.1), 3.0 * end.e.u_val));
  // A renamed copy, its strain rounded.
  PreparedRecording copy = request.calibration.files.front().recording.value();
  copy.name = "copy.csv";
  copy.recording.header.sha256 = "other";
  for (double& strain : copy.recording.response) strain = 1e-9 * std::round(1e9 * strain);
  request.recordings = {std::move(copy)};
  CHECK(validate(request).verdict == ModelVerdict::residual);
}

TEST_CASE("a law of creep is validated on relaxation", "[validate][creep]") {
  // 60 Pa of creep follow 2 kPa and 3 kPa that relax in 5 s; so does a strain of 4 % within 1 s.
  Recording r;
  r.header.id = "relaxation";
  r.drive_quantity = Quantity::strain;
  r.response_quantity = Quantity::stress;
  base::Random random(5);
  for (int i = 0; i <= 300; ++i) {
    const double t = 0.1 * i, since = std::max(t - 4.0, 0.0), up = std::min(since, 1.0);
    const double fast =
        3000.0 * 0.04 * 5.0 * (std::exp(-(since - up) / 5.0) - std::exp(-since / 5.0));
    r.time_s.push_back(t);
    r.drive.push_back(0.04 * up);
    r.response.push_back(2000.0 * 0.04 * up + fast + 0.4 * random.normal());
  }
  const Validation v = validate(request_with(prepare_recording("relaxation.csv", r)));
  INFO(to_terminal_text(v));
  CHECK_FALSE(v.recordings.front().creep);
  CHECK(v.verdict == ModelVerdict::not_seen);
  for (double& stress : r.response) stress *= 1.1;
  const Validation stiffer = validate(request_with(prepare_recording("relaxation.csv", r)));
  CHECK(stiffer.verdict == ModelVerdict::seen);
}

}  // namespace tpm::fit
