// The band of an organ that a law was put on: against organs fitted to laws drawn from the law's
// covariance, the law where the organ is the law's star, the file that carries it, a recording
// beside it, and what is refused.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "liver_of_60.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/predict/organ_prediction.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

LawFile uncertain_law() {
  LawFile law;
  law.spec = parse_law_name("linear-2", "test");
  law.spec.reference = 4e-3;
  law.values = {100.0, 50.0, 30.0, 0.5, 5.0, 3e-4, 0.02};
  law.provenance = Provenance::derived;
  law.fitted_to = 4e-3;
  LawUncertainty u;
  u.place = {0, 1, 2, 5, 6};
  u.coordinate = {Coordinate::linear, Coordinate::log, Coordinate::log, Coordinate::linear,
                  Coordinate::linear};
  // k_inf, ln k1, ln k2, contact and offset; the first and the contact depend on one another.
  const Eigen::VectorXd sd = (Eigen::VectorXd(5) << 2.0, 0.03, 0.05, 2e-5, 1e-3).finished();
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(5, 5);
  correlation(0, 1) = correlation(1, 0) = -0.5;
  correlation(0, 3) = correlation(3, 0) = 0.6;
  u.covariance = sd.asDiagonal() * correlation * sd.asDiagonal();
  u.noise.absolute = 2e-3;
  u.duration_s = 8.0;
  law.uncertainty = u;
  return law;
}

/// The paper's star: four spheres, quick enough for many fits.
Json prediction_star() {
  return Json::parse(R"({"organ": {"kind": "star"}, "contacts": [{"kind": "sphere"}]})");
}

OrganMaterial fitted_star(const LawFile& law) {
  return put_on_organ(law, {testing::ramp_to_2_mm()}, prediction_star(), "test", {}, {});
}

/// A liver of 60 spheres, fitted once.
const OrganMaterial& fitted_organ() {
  static const OrganMaterial once = put_on_organ(uncertain_law(), {testing::ramp_to_2_mm()},
                                                 testing::liver_of_60(), "test", {}, {});
  return once;
}

const std::vector<double> kAskedTimes{0.2, 0.5, 1.0, 2.0, 5.0};

/// The prediction that is checked: deeper and faster than what was fitted.
LawPrediction predicted(const OrganOfLaw& organ, const PredictionOptions& options = {}) {
  return predict_organ(organ, ramp_and_hold(4e-3, 8e-3, 5.0), kAskedTimes, options);
}

}  // namespace

TEST_CASE("the band of an organ is what organs fitted to drawn laws scatter by") {
  const LawFile law = uncertain_law();
  const LawUncertainty& u = *law.uncertainty;
  const LawPrediction p = predicted(organ_of_law(fitted_star(law), "test"));
  const Eigen::MatrixXd root = u.covariance.llt().matrixL();
  constexpr int kDraws = 60;
  Random random(7);
  Eigen::MatrixXd answers(std::ssize(kAskedTimes), kDraws);
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::VectorXd z(5);
    for (double& each : z) each = random.normal();
    const Eigen::VectorXd moved = root * z;
    LawFile other = law;
    for (std::size_t k = 0; k < 5; ++k) {
      const std::size_t place = u.place[k];
      other.values[place] =
          from_coordinate(u.coordinate[k], to_coordinate(u.coordinate[k], law.values[place]) +
                                               moved[static_cast<Eigen::Index>(k)]);
    }
    answers.col(draw) =
        Eigen::VectorXd::Map(predicted(organ_of_law(fitted_star(other), "test")).response.data(),
                             std::ssize(kAskedTimes));
  }
  const Eigen::VectorXd mean = answers.rowwise().mean();
  for (std::size_t i = 0; i < kAskedTimes.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double sd = std::sqrt((answers.row(k).array() - mean[k]).square().sum() / (kDraws - 1));
    CAPTURE(kAskedTimes[i]);
    CHECK(p.standard_error[i] > 0.0);
    // 59 degrees of freedom: chi-square puts the ratio within 0.73 .. 1.27 with 99.7 %.
    CHECK(p.standard_error[i] == Approx(sd).epsilon(0.27));
    CHECK(p.response[i] == Approx(mean[k]).margin(4.0 * sd / std::sqrt(kDraws)));
  }
}

TEST_CASE("samples and derivatives give an organ one band") {
  const OrganOfLaw organ = organ_of_law(fitted_organ(), "test");
  const LawPrediction by_derivatives = predicted(organ);
  PredictionOptions options;
  options.samples = 100;
  options.seed = 3;
  const LawPrediction by_samples = predicted(organ, options);
  for (std::size_t i = 0; i < kAskedTimes.size(); ++i) {
    const double half = by_derivatives.mean_upper[i] - by_derivatives.response[i];
    CHECK(by_samples.mean_upper[i] - by_samples.mean_lower[i] == Approx(2.0 * half).epsilon(0.35));
  }
  CHECK(by_derivatives.organ_spheres == 60);
  CHECK(by_derivatives.reading_upper[2] - by_derivatives.mean_upper[2] > 0.0);
}

TEST_CASE("a small depth on an organ has the law's band") {
  // Correspondence is exact there: force and band are the law's, up to the organ's own tolerance.
  const LawFile law = uncertain_law();
  std::vector<double> times;
  for (int i = 0; i <= 24; ++i) times.push_back(0.25 * i);
  const MaterialMotion shallow = motion_of_protocol(ramp_and_hold(2e-6, 2e-6, 5.0), times);
  const OrganOfLaw organ =
      organ_of_law(put_on_organ(law, {shallow}, testing::liver_of_60(), "test", {}, {}), "test");
  const Protocol other = ramp_and_hold(1e-6, 4e-6, 5.0);
  const LawPrediction of_organ = predict_organ(organ, other, kAskedTimes, {});
  const LawPrediction of_law = predict_law(law, other, kAskedTimes, {});
  for (std::size_t i = 0; i < kAskedTimes.size(); ++i) {
    CHECK(of_organ.response[i] == Approx(of_law.response[i]).epsilon(2e-3));
    CHECK(of_organ.standard_error[i] == Approx(of_law.standard_error[i]).epsilon(2e-2));
  }
}

TEST_CASE("the written files carry the covariance, and only for their own tissue") {
  const test::TempFolder temporary;
  const std::filesystem::path& folder = temporary.path();
  const OrganMaterial m = fitted_organ();
  write_file(folder / "scene.json", to_text(m.scene));
  const auto scene = (folder / "scene.json").string();
  CHECK_THAT(test::refusal_of([&] { (void)read_organ_of_law(scene); }),
             Contains("without the material.json of its fit beside it"));
  write_file(folder / "material.json", to_text(to_json(m)));
  const LawPrediction direct = predicted(organ_of_law(m, "test"));
  for (const char* name : {"scene.json", "material.json"}) {
    const LawPrediction read = predicted(read_organ_of_law(folder / name));
    for (std::size_t i = 0; i < kAskedTimes.size(); ++i) {
      CHECK(read.response[i] == Approx(direct.response[i]).epsilon(1e-6));
      CHECK(read.standard_error[i] == Approx(direct.standard_error[i]).epsilon(1e-4));
    }
  }
  Json softer = m.scene;
  softer["material"]["Einf"] = "1 kPa";
  write_file(folder / "scene.json", to_text(softer));
  CHECK_THAT(test::refusal_of([&] { (void)read_organ_of_law(scene); }),
             Contains("differs from the scene that was fitted"));
  LawFile certain = uncertain_law();
  certain.uncertainty.reset();
  CHECK_THAT(test::refusal_of([&] { (void)organ_of_law(fitted_star(certain), "test"); }),
             Contains("carries no uncertainty"));
}

TEST_CASE("an organ beside a recording finds its contact and offset") {
  const LawFile law = uncertain_law();
  const OrganOfLaw organ = organ_of_law(fitted_organ(), "test");
  constexpr double kContact = 4.5e-4, kOffset = -0.013, kDepth = 3e-3;
  std::vector<double> own = law.values;
  own[5] = kContact;
  own[6] = kOffset;
  Recording r;
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  for (int i = 0; i <= 120; ++i) {
    r.time_s.push_back(0.05 * i);
    r.drive.push_back(std::min(kDepth * r.time_s.back() / 1.5, kDepth));
  }
  const Protocol motion = measured_history(Drive::displacement, r.time_s, r.drive);
  const Eigen::VectorXd force = organ.respond(motion, r.time_s, own, Want::values).value;
  r.response.assign(force.begin(), force.end());
  const PreparedRecording prepared = prepare_recording("made.csv", r);
  const LawPrediction p = predict_organ(organ, prepared, {});
  CHECK(p.placement == Placement::own);
  CHECK(p.contact == Approx(kContact).epsilon(2e-2));
  CHECK(p.offset == Approx(kOffset).epsilon(2e-2));
  REQUIRE(p.recording);
  CHECK(p.recording->held_out.rms < 1e-3 * p.recording->peak);
  CHECK(*p.recording->held_out.share_in_reading_band == 1.0);
}

TEST_CASE("an organ under a load has no contact and offset") {
  const OrganOfLaw organ = organ_of_law(fitted_organ(), "test");
  const Protocol load = creep(0.1, 5.0);
  const LawPrediction p = predict_organ(organ, load, kAskedTimes, {});
  CHECK(p.response.back() > p.response.front());
  CHECK(p.standard_error.back() > 0.0);
  PredictionOptions fitted;
  fitted.placement = Placement::fitted;
  CHECK_THAT(test::refusal_of([&] { (void)predict_organ(organ, load, kAskedTimes, fitted); }),
             Contains("under a load with a contact point"));
}

}  // namespace tpm::fit
