// The covariance of a law's parameters from the recordings that it was fitted to.
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/fit/validate/measured_placement_weights.hpp"
#include "validation_studies.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;

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

TEST_CASE("a contact that a force puts between two samples is uncertain in the calibration, too",
          "[validate]") {
  Random random(12);
  test::StudyNoise noise;
  noise.sigma_N = 2e-4;
  noise.zero_N = 0.0;
  PhaseOptions phases;
  phases.contact_response = 5e-3;
  const PreparedRecording held =
      prepare_recording("held", test::study_recording({}, noise, random), phases);
  REQUIRE(held.contact_held);
  SetupOptions setup;
  setup.profiles = false;
  setup.reference = 4e-3;
  setup.starts = 2;
  const auto fit_of = [&](const PreparedRecording& recording) {
    const std::vector<PreparedRecording> one{recording};
    return fitted_law(run_fit(recording_config(test::study_law(), one, setup), data_sets(one)));
  };
  const LawFile law = fit_of(held);
  PreparedRecording known = held;
  known.contact_held = false;  // as if contact was known
  const std::vector<PreparedRecording> with{held}, without{known};
  const Eigen::MatrixXd added = with_calibration_covariance(law, with)->uncertainty->covariance -
                                with_calibration_covariance(law, without)->uncertainty->covariance;
  // A second way: the law fitted with contact later by u, one step of the drive over sqrt 3.
  const std::size_t at = held.phases.contact_index;
  const std::vector<double>& drive = held.recording.drive;
  const double u = (drive[at] - drive[at - 1]) / std::numbers::sqrt3;
  PreparedRecording later = held;
  later.phases.contact_drive += u;
  const LawFile moved = fit_of(later);
  REQUIRE(moved.uncertainty->place == law.uncertainty->place);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t place = law.uncertainty->place[k];
    const auto coordinate = law.uncertainty->coordinate[k];
    const double by = to_coordinate(coordinate, moved.values[place]) -
                      to_coordinate(coordinate, law.values[place]);
    CAPTURE(k, by, added(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)));
    CHECK_THAT(std::sqrt(added(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k))),
               WithinRel(std::abs(by), 0.1));
  }
}

TEST_CASE("a law of several recordings whose contacts a force found says so", "[validate]") {
  Random random(13);
  PhaseOptions phases;
  phases.contact_response = 20e-3;
  const auto made = [&](const char* name) {
    return prepare_recording(name, test::study_recording({}, {}, random), phases);
  };
  ValidationRequest request;
  const std::vector<PreparedRecording> fitted{made("a"), made("b")};
  request.law = test::study_fit(fitted);
  request.recordings = {made("c")};
  request.contact_by_threshold = true;
  for (const PreparedRecording& r : fitted) {
    request.calibration.files.push_back({r.name, r.name, r, ""});
  }
  const std::string text = to_terminal_text(validate(request));
  CHECK_THAT(text, Contains("with one step of the drive at the contact"));
  CHECK_THAT(text, !Contains("fitted without --contact-force"));
  // Contacts that were fitted are no threshold's.
  std::vector<PreparedRecording> free = fitted;
  for (PreparedRecording& r : free) r.contact_held = false;
  request.law = test::study_fit(free);
  CHECK_THAT(to_terminal_text(validate(request)), Contains("fitted without --contact-force"));
  request.calibration.files.front().recording.reset();
  CHECK_THAT(to_terminal_text(validate(request)), Contains("not known without its recordings"));
}

}  // namespace tpm::fit
