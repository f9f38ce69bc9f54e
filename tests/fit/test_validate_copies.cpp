// Fitted data get no verdict of tpm validate, however they come back.
#include <catch2/catch.hpp>
#include <cmath>

#include "quiet_recordings.hpp"
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
                                         [](const std::string&) { return PreparedRecording(); });
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
    CHECK_THAT(v.remarks.front(), Contains("those of fitted.csv"));
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
  refused("half of it replaced", [&](std::size_t i, double&, double&, double& f) {
    if (i % 5 < 2) f = other.recording.response[i];
    return true;
  });
}

}  // namespace tpm::fit
