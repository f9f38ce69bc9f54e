// Fitted data get no verdict of tpm validate, however they come back.
#include <catch2/catch.hpp>
#include <cmath>

#include "quiet_recordings.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/sample_digest.hpp"
#include "tpm/fit/validate/fitted_copy.hpp"

namespace tpm::fit {

using Catch::Matchers::Contains;
using test::quiet_recording;
using test::request_for;

TEST_CASE("a renamed and resaved copy of fitted data gets no verdict", "[validate]") {
  const PreparedRecording fitted = prepare_recording("fitted.csv", quiet_recording(1.0).recording);
  SetupOptions setup;
  setup.profiles = false;
  setup.starts = 2;
  const std::vector<PreparedRecording> data{fitted};
  const FitResult fit = run_fit(recording_config(test::study_law(), data, setup), data_sets(data));
  const Json document = law_document(fit);
  const std::vector<std::string> digests = sample_digests(document);
  REQUIRE(digests.size() == 1);
  PreparedRecording copy = fitted;
  copy.name = "another.csv";
  copy.recording.header.sha256 = "of other bytes";
  for (double& f : copy.recording.response) f *= 1.0 + 1e-15;  // units back and forth
  CHECK(samples_sha256(copy.recording) == digests.front());
  ValidationRequest request = request_for(fitted_law(fit), copy);
  request.calibration = find_calibration(request.law, "nowhere/law.json", digests,
                                         {[](const std::string&) { return PreparedRecording(); }});
  CHECK(validate(request).verdict == ModelVerdict::residual);
  request.recordings.front().recording.response[100] += 1e-6;
  CHECK(validate(request).verdict != ModelVerdict::residual);
}

TEST_CASE("parts of fitted data get no verdict, whatever was done to them", "[validate]") {
  // 2 mN of scatter.
  Random random(8);
  const test::StudyNoise noise;
  const PreparedRecording fitted =
      prepare_recording("fitted.csv", test::study_recording({}, noise, random));
  const PreparedRecording other =
      prepare_recording("other.csv", test::study_recording({}, noise, random));
  const LawFile law = test::study_fit({fitted});
  ValidationRequest request = request_for(law, other);
  request.calibration.files.push_back({"fitted.csv", "of the bytes", fitted, ""});
  // The same protocol, readings of its own.
  CHECK(share_of_readings(other.recording, fitted.recording, noise.sigma_N) < 0.1);
  CHECK(validate(request).verdict != ModelVerdict::residual);
  const auto refused = [&](const char* what, const auto& change) {
    Recording r;
    for (std::size_t i = 0; i < fitted.recording.time_s.size(); ++i) {
      double t = fitted.recording.time_s[i], d = fitted.recording.drive[i],
             f = fitted.recording.response[i];
      if (!change(i, t, d, f)) continue;
      r.time_s.push_back(t);
      r.drive.push_back(d);
      r.response.push_back(f);
    }
    request.recordings = {prepare_recording("copy.csv", std::move(r))};
    const Validation v = validate(request);
    CAPTURE(what, to_terminal_text(v),
            share_of_readings(request.recordings.front().recording, fitted.recording,
                              v.recordings.front().scatter.sigma));
    CHECK(v.verdict == ModelVerdict::residual);
    REQUIRE(v.remarks.size() == 1);
    CHECK(v.remarks.front().code == "copied_readings");
    CHECK_THAT(v.remarks.front().text, Contains("those of fitted.csv"));
  };
  refused("cut", [](std::size_t i, double&, double&, double&) { return i > 20 && i < 200; });
  refused("later", [](std::size_t, double& t, double&, double&) {
    t += 7.3;
    return true;
  });
  refused("thinned out", [](std::size_t i, double&, double&, double&) { return i % 2 == 0; });
  refused("sampled again between its samples", [&](std::size_t i, double& t, double& d, double& f) {
    const Recording& r = fitted.recording;
    if (i + 1 == r.time_s.size()) return false;
    t = std::lerp(t, r.time_s[i + 1], 0.3);
    d = std::lerp(d, r.drive[i + 1], 0.3);
    f = std::lerp(f, r.response[i + 1], 0.3);
    return true;
  });
  refused("rounded", [](std::size_t, double&, double&, double& f) {
    f = 1e-5 * std::round(1e5 * f);
    return true;
  });
  refused("zeroed anew, from its ramp on", [](std::size_t i, double& t, double& d, double& f) {
    t -= 3.9;
    d += 1e-3;
    f -= 4e-3;
    return i >= 30;
  });
  refused("half of it replaced", [&](std::size_t i, double&, double&, double& f) {
    if (i % 5 < 2) f = other.recording.response[i];
    return true;
  });
}

TEST_CASE("the same readings under two names are refused", "[validate]") {
  const PreparedRecording one = quiet_recording(1.0);
  ValidationRequest request = request_for(test::quiet_law(), one);
  request.recordings.push_back(one);
  request.recordings.back().name = "copy";
  CHECK_THROWS_WITH(validate(request),
                    Contains("recording 'copy'") && Contains("each recording once"));
}

TEST_CASE("stiffer tissue with the same scatter is no copy", "[validate]") {
  // As of a simulation with one seed: held, both differ by a constant.
  const test::StudyNoise noise;
  test::StudyTest long_hold;
  long_hold.hold_s = 200.0;
  Random one(4), same(4);
  const Recording fitted = test::study_recording(long_hold, noise, one);
  const Recording stiffer = test::study_recording(long_hold, noise, same, 1.05);
  CHECK(share_of_readings(stiffer, fitted, noise.sigma_N) < 0.5);
}

TEST_CASE("the calibration's files are read as they were fitted", "[validate]") {
  // The new recordings may need options that the old ones were not fitted with.
  const PreparedRecording fitted = prepare_recording("fitted.csv", quiet_recording(1.0).recording);
  const test::TempFolder folder;
  const std::string bytes = "stands for its file", path = (folder.path() / "fitted.csv").string();
  write_file(path, bytes);
  LawFile law = test::study_fit({fitted});
  FittedFile& file = law.uncertainty.value().data.at(0);
  file.name = path;
  file.sha256 = sha256_hex(bytes);
  const std::vector<std::string> digests{samples_sha256(fitted.recording)};
  const auto whole = [&](const std::string&) { return fitted; };
  const auto cut = [&](const std::string&) {
    PreparedRecording part = fitted;
    part.recording.time_s.pop_back();
    part.recording.drive.pop_back();
    part.recording.response.pop_back();
    return part;
  };
  const auto fails = [](const std::string&) -> PreparedRecording {
    throw bad_input("fitted.csv", "no column 't'", "column 1 'time'");
  };
  for (const auto& first : {std::function<PreparedRecording(const std::string&)>(cut),
                            std::function<PreparedRecording(const std::string&)>(fails)}) {
    const CalibrationData found = find_calibration(law, "law.json", digests, {first, whole});
    CHECK(found.remarks.empty());
    REQUIRE(found.files.front().recording);
    CHECK(found.files.front().recording->recording.time_s == fitted.recording.time_s);
    const CalibrationData lost = find_calibration(law, "law.json", digests, {first});
    CHECK_FALSE(lost.files.front().recording);
    REQUIRE(lost.remarks.size() == 1);
  }
  CHECK(find_calibration(law, "law.json", digests, {cut}).remarks.front().code ==
        "calibration_read_differently");
  CHECK(find_calibration(law, "law.json", digests, {fails}).remarks.front().code ==
        "calibration_unreadable");
}

}  // namespace tpm::fit
