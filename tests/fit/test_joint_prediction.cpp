// A law file holds what is needed to predict the recordings that the law was fitted to: the slack
// length of the specimen, and contact and offset of each recording.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "joint_recordings.hpp"
#include "tpm/fit/validate/comparison.hpp"

using namespace tpm;
using namespace tpm::fit;

TEST_CASE("a fitted recording is predicted as it was fitted", "[predict][joint]") {
  const auto drive =
      GENERATE(Quantity::indentation_depth, Quantity::strain, Quantity::relative_length);
  const std::string law = GENERATE("linear-1", "power-1");
  const int count = GENERATE(1, 2, 3);
  test::check_predicted_as_fitted(law, drive, count, true);
}

TEST_CASE("a law of several recordings has no placement for another", "[predict][joint]") {
  const LawSpec spec = test::spec_of("linear-1", Quantity::indentation_depth);
  const std::vector<PreparedRecording> two = test::joint_recordings(spec, 2);
  SetupOptions setup;
  setup.starts = 5;
  setup.profiles = false;
  const FitResult fit = run_fit(recording_config(spec, two, setup), data_sets(two));
  const LawFile law = fitted_law(fit);
  const PreparedRecording other = test::joint_recordings(spec, 3).back();
  CHECK(predict_recording(law, other, {}).placement == Placement::own);
  PredictionOptions options;
  options.placement = Placement::fitted;
  CHECK_THROWS_WITH(predict_recording(law, other, options),
                    Catch::Contains("this is none of them"));
}

TEST_CASE("strips with slack lengths of their own that are fitted together keep them", "[joint]") {
  for (const char* name : {"linear-1", "power-1"}) {
    CAPTURE(name);
    const LawSpec spec = test::spec_of(name, Quantity::relative_length);
    const std::vector<PreparedRecording> strips = test::joint_recordings(spec, 3);
    SetupOptions setup;
    setup.starts = 6;
    setup.profiles = false;
    const FitResult fit = run_fit(recording_config(spec, strips, setup), data_sets(strips));
    const LawFile law = fitted_law(fit);
    REQUIRE(law.uncertainty);
    const std::vector<FittedFile>& files = law.uncertainty->data;
    REQUIRE(files.size() == 3);
    for (int k = 0; k < 3; ++k) {
      CAPTURE(k);
      const FittedFile& file = files[static_cast<std::size_t>(k)];
      REQUIRE(file.contact);
      CHECK(std::abs(*file.contact - test::slack_length_of(k)) < 0.004);
      // Not at the mean of the slack lengths, which none of them has.
      const RecordingComparison compared =
          compare_with_recording(law, strips[static_cast<std::size_t>(k)], {});
      CHECK(std::abs(compared.placement.contact - test::slack_length_of(k)) < 0.01);
    }
    const RecordingFit& last = fit.recordings.back();
    CHECK(last.rms_residual < 0.004 * last.peak);  // noise of 0.2 % of the first peak
  }
}
