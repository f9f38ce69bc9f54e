// The scene that a fit with an organ leaves answers in a run as the fit says.
#include <catch2/catch.hpp>
#include <filesystem>

#include "tpm/scene/experiment_scene.hpp"
#include "tpm/simulate/scene_runner.hpp"
#include "tpm/store/file.hpp"
#include "tpm/store/json.hpp"
#include "tpm/study/fitted_scene.hpp"

namespace tpm {
namespace {

/// A fit of the paper's relaxation table with a star of four spheres.
FitResult star_fit(const std::string& material, const std::string& parameters) {
  const auto folder = std::filesystem::temp_directory_path() / "tpm_fitted_scene";
  write_file(folder / "s.json", R"({"organ": {"kind": "star"}, "material": )" + material + "}");
  const Json config = Json::parse(
      R"({"title": "star", "model": "organ", "scene": "s.json", "parameters": )" + parameters +
      R"(, "data": [{"dataset": "evren_relaxation",
           "protocol": {"kind": "ramp_hold", "rate": "4 mm/s", "rate_provenance": "assumed"},
           "noise": {"kind": "relative_to_datum", "relative": 0.1}}],
         "starts": {"count": 1}, "profile": {"enabled": false}})");
  const FitResult fit = run_fit(parse_fit_config(config, "test", folder));
  return fit;
}

/// Peak and end of the deepest reading, as the fit predicts them, against the scene's run.
void check_run(const FitResult& fit) {
  const auto fitted = fitted_scene(fit);
  REQUIRE(fitted);
  CHECK(fitted->scene.at("protocol").at("depth") == "8 mm");
  CHECK(fitted->session.at("model").at("scene").at("material") == fitted->scene.at("material"));
  check_schema(fitted->session, "hil", "test");
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
  check_run(star_fit(
      R"({"Einf": "8 kPa", "Eprime": "12 kPa", "branches": [{"g": "6 kPa", "tau": "5 s"}]})",
      R"({"Einf": {"start": "8 kPa", "lower": "0.1 kPa", "upper": "900 kPa"},
          "g1": {"start": "6 kPa", "lower": "0.1 kPa", "upper": "900 kPa"}})"));
}

TEST_CASE(
    "the scene of an organ of the paper's element answers as its fit, at the fitted spacing") {
  check_run(star_fit(
      R"({"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "100 kPa s"})",
      R"({"E": {"start": "12 kPa", "lower": "0.1 kPa", "upper": "900 kPa", "sets": ["E1", "E2", "Eprime"]},
          "spacing": {"start": "30 mm", "lower": "8 mm", "upper": "60 mm", "scale": "inverse_square"}})"));
}

}  // namespace tpm
