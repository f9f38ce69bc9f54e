// The scene that a fit with an organ leaves answers in a run as the fit says.
#include <fmt/format.h>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/data/straight_pieces.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/predict/fitted_scene.hpp"
#include "tpm/haptics/session/session_keys.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/organ/scene/organ_model.hpp"

namespace tpm::fit {
namespace {

/// A fit of the paper's relaxation table with a star of four spheres.
/// @param folder for the scene, which fitted_scene() reads again
FitResult star_fit(const test::TempFolder& folder, const std::string& material,
                   const std::string& parameters) {
  write_file(folder / "s.json", R"({"organ": {"kind": "star"}, "material": )" + material + "}");
  const Json config = Json::parse(
      R"({"title": "star", "model": "organ", "scene": "s.json", "parameters": )" + parameters +
      R"(, "data": [{"dataset": "evren_relaxation",
           "protocol": {"kind": "ramp_hold", "rate": "4 mm/s", "rate_provenance": "assumed"},
           "noise": {"kind": "relative_to_datum", "relative": 0.1}}],
         "starts": {"count": 1}, "profile": {"enabled": false}})");
  const FitResult fit = run_fit(parse_fit_config(config, "test", folder.path()));
  return fit;
}

/// Peak and end of the deepest reading, as the fit predicts them, against the scene's run.
void check_run(const FitResult& fit) {
  const auto fitted = fitted_scene(fit);
  REQUIRE(fitted);
  CHECK(fitted->scene.at("protocol").at("depth") == "8 mm");
  CHECK(fitted->session.at("model").at("scene").at("material") == fitted->scene.at("material"));
  (void)files::checked(fitted->session, haptics::session_kind(), "test");
  const std::vector<double> times{2.0, 32.0};  // 8 mm at 4 mm/s, and 30 s later
  const Trajectory run = run_scene(parse_experiment(fitted->scene, "test", {}), times, false);
  int compared = 0;
  for (const FittedDatum& d : fit.data) {
    if (!d.imposed_depth_m || std::abs(*d.imposed_depth_m - 8e-3) > 1e-9) continue;
    const bool peak = d.datum.label.find("peak") != std::string::npos;
    CHECK(run.response[peak ? 0 : 1] == Approx(d.predicted).epsilon(1e-4));
    ++compared;
  }
  CHECK(compared == 2);
}

}  // namespace

TEST_CASE("the scene of an organ with branches answers as its fit") {
  const test::TempFolder folder;
  check_run(star_fit(
      folder,
      R"({"Einf": "8 kPa", "Eprime": "12 kPa", "branches": [{"g": "6 kPa", "tau": "5 s"}]})",
      R"({"Einf": {"start": "8 kPa", "lower": "0.1 kPa", "upper": "900 kPa"},
          "g1": {"start": "6 kPa", "lower": "0.1 kPa", "upper": "900 kPa"}})"));
}

TEST_CASE(
    "the scene of an organ of the paper's element answers as its fit, at the fitted spacing") {
  const test::TempFolder folder;
  check_run(star_fit(
      folder, R"({"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "100 kPa s"})",
      R"({"E": {"start": "12 kPa", "lower": "0.1 kPa", "upper": "900 kPa", "sets": ["E1", "E2", "Eprime"]},
          "spacing": {"start": "30 mm", "lower": "8 mm", "upper": "60 mm", "scale": "inverse_square"}})"));
}

TEST_CASE("an organ follows a measured motion in straight pieces, nearly as it does the whole") {
  const test::TempFolder folder;
  write_file(folder / "s.json", R"({"organ": {"kind": "star"}, "material": {"Einf": "8 kPa",
      "Eprime": "12 kPa", "branches": [{"g": "6 kPa", "tau": "1.5 s"}]}})");
  constexpr double kDeepest = 4e-3, kRamp_s = 1.0, kJitter = 3e-4;
  constexpr int kSamples = 1000;
  Random random(5);
  std::vector<double> time, depth;
  for (int i = 0; i < kSamples; ++i) {  // eased in and out, then held, with a motor's jitter
    time.push_back(5e-3 * i);
    const double way = std::min(time.back() / kRamp_s, 1.0);
    depth.push_back(kDeepest * (0.5 - 0.5 * std::cos(M_PI * way) + kJitter * random.normal()));
  }
  const OrganModel model(std::make_shared<Tissue>(read_tissue(folder / "s.json")));
  Protocol whole = measured_history(Drive::displacement, time, depth);
  whole.set_equilibrium_at_start(true);
  const Eigen::VectorXd force = model.respond(whole, time, model.own_values(), Want::values).value;
  std::string csv = "time [s],depth [m],force [N]\n";
  for (std::size_t i = 0; i < time.size(); ++i) {
    csv += fmt::format("{},{},{}\n", time[i], depth[i], force[static_cast<Eigen::Index>(i)]);
  }
  write_file(folder / "r.csv", csv);
  const FitConfig config =
      parse_fit_config(Json::parse(
                           R"({"title": "star", "model": "organ", "scene": "s.json", "parameters": {
               "Einf": {"start": "5 kPa", "lower": "0.1 kPa", "upper": "900 kPa"},
               "g1": {"start": "9 kPa", "lower": "0.1 kPa", "upper": "900 kPa"}},
             "data": [{"dataset": "r.csv", "protocol": {"kind": "measured"},
               "noise": {"kind": "absolute", "absolute": "1 mN"}}],
             "starts": {"count": 1}, "profile": {"enabled": false}})"),
                       "test", folder.path());

  const ExperimentResiduals function(config);
  const Protocol followed = followed_by_organ(whole);
  CHECK(followed.knots().size() < 50);
  CHECK(followed.equilibrium_at_start());
  double off = 0.0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    off = std::max(off, std::abs(value_at(followed, time[i]) - depth[i]));
  }
  CHECK(off <= kMotionWithin * *std::max_element(depth.begin(), depth.end()));
  CHECK(off > 0.0);
  const std::vector<double> true_values{8e3, 6e3};
  const double apart = (function.predict(true_values, nullptr) - force).cwiseAbs().maxCoeff();
  CHECK(apart > 0.0);  // the pieces, not the whole
  CHECK(apart < 3.0 * kMotionWithin * force.maxCoeff());

  const FitResult fit = run_fit(config);
  CHECK(fit.best.natural[0] == Approx(true_values[0]).epsilon(2e-3));
  CHECK(fit.best.natural[1] == Approx(true_values[1]).epsilon(5e-3));
  REQUIRE(fit.recordings.size() == 1);
  REQUIRE(fit.recordings.front().drive.size() == depth.size());
  for (std::size_t i = 0; i < depth.size(); ++i) {
    CHECK(fit.recordings.front().drive[i] == Approx(depth[i]).margin(1e-12));
  }
  const auto stated = [](const Remark& remark) {
    return remark.code == "motion_followed" &&
           remark.text.find(
               "follows the 1000 samples of the motion of 'r.csv' within 0.2 % of its") !=
               std::string::npos;
  };
  CHECK(std::ranges::count_if(fit.remarks, stated) == 1);
}

}  // namespace tpm::fit
