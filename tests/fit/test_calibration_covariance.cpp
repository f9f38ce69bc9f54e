// The covariance of a law's parameters from the recordings that it was fitted to.
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/fit/validate/measured_placement_weights.hpp"
#include "validation_studies.hpp"

namespace tpm::fit {
namespace {

PreparedRecording ramp_and_hold_with(const test::StudyNoise& noise) {
  Random random(8);
  return prepare_recording("calibration", test::study_recording({}, noise, random));
}

}  // namespace

TEST_CASE("an onset that was stated has no weights", "[validate]") {
  const PreparedRecording r = ramp_and_hold_with({});
  Onset stated;
  stated.from_rest = false;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(std::ssize(r.recording.response));
  CHECK_FALSE(onset_by_reading(r, stated, 1.0, 0.0, none));
  RestReadings after = read_rests(r);
  after.after = 20;
  CHECK_FALSE(zero_by_reading(r.recording, after));
}

TEST_CASE("u_input is what the law's error scatters by, also where a branch is left out",
          "[validate]") {
  const double slow_branch = GENERATE(0.0, 6.0);
  CAPTURE(slow_branch);
  const test::StudyTest asked = test::study_validation(40, 0.0);
  test::StudyNoise noise, clean;
  clean.sigma_N = clean.zero_N = 0.0;
  Random random(57), unused(0);
  const PreparedRecording truth =
      prepare_recording("truth", test::study_recording(asked, clean, unused, 1.0, slow_branch));
  const RecordingParts parts = parts_of(truth);
  constexpr int kExperiments = 80;
  Eigen::MatrixXd s(kExperiments, 2);
  Eigen::RowVector2d variance = Eigen::RowVector2d::Zero();
  for (int i = 0; i < kExperiments; ++i) {
    const LawFile law = test::study_calibration(1, noise, random, slow_branch);
    const LawAlong along(law, truth);
    const LawAlong::At at = along.at(0.0);
    for (const int k : {0, 1}) {
      const QuantityKind kind = k == 0 ? QuantityKind::peak : QuantityKind::end_of_hold;
      const auto q = read_quantity({kind}, parts, truth.recording, 0.0, at.value).value();
      s(i, k) = q.value;
      variance[k] += (q.weight.transpose() * at.by_law * along.root()).squaredNorm() / kExperiments;
    }
  }
  const Eigen::RowVector2d mean = s.colwise().mean();
  const Eigen::RowVector2d seen = (s.rowwise() - mean).colwise().squaredNorm() / (kExperiments - 1);
  // The standard deviation of 80 is known to 8 %. Where the law leaves something out, the fit holds
  // to the onset, and one at the depth of the rest moves to one side only: u is a third too large.
  for (const int k : {0, 1}) {
    const double ratio = std::sqrt(seen[k] / variance[k]);
    CHECK(ratio > (slow_branch > 0.0 ? 0.65 : 0.8));
    CHECK(ratio < 1.2);
  }
}

}  // namespace tpm::fit
