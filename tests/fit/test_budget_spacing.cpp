// The budget's line `spacing`: against runs of the two scenes, and only for one material.
#include <catch2/catch.hpp>

#include "refusal.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"

namespace tpm::fit {
namespace {

using Catch::Matchers::Contains;

/// A cube of 120 mm on the ground, pushed in at the middle of its upper face.
Json cube(int cells, const std::string& spacing) {
  Json scene = Json::parse(R"({
    "organ": {"kind": "block", "lattice": "cubic"},
    "bonds": {"rule": "per_bond", "spacing_law": "continuum", "reference_spacing": "30 mm"},
    "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "24 kPa s"},
    "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "0.001 mm"],
                 "normal": [0, 0, -1]}],
    "contacts": [{"kind": "sphere", "at": ["60 mm", "60 mm", "120 mm"],
                  "direction": [0, 0, -1]}],
    "protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "4 mm/s", "hold": "2 s"}})");
  scene["organ"]["cells"] = {cells, cells, cells};
  scene["organ"]["spacing"] = spacing;
  return scene;
}

ErrorBudget budget_of_cubes(const Json& scene, const Json& finer) {
  return organ_budget({}, parse_experiment(scene, "test", {}), parse_experiment(finer, "test", {}),
                      "5%", {});
}

}  // namespace

TEST_CASE("the line spacing is the scene less the finer one, and telescopes") {
  Json scene = cube(4, "30 mm");
  scene["bonds"]["spacing_law"] = "paper";  // at its own spacing as stiff
  scene["bonds"].erase("reference_spacing");
  const Json finer = cube(6, "20 mm");
  const ErrorBudget budget = budget_of_cubes(scene, finer);
  const auto line = std::find_if(budget.lines.begin(), budget.lines.end(),
                                 [](const BudgetLine& each) { return each.name == "spacing"; });
  REQUIRE(line != budget.lines.end());
  CHECK(line->kind == BudgetKind::tissue);
  CHECK(line->largest > kLeastLine);
  const Trajectory coarse = run_scene(parse_experiment(scene, "test", {}), budget.time_s, false);
  const Trajectory fine = run_scene(parse_experiment(finer, "test", {}), budget.time_s, false);
  for (std::size_t i = 0; i < budget.time_s.size(); i += 10) {
    const auto k = static_cast<Eigen::Index>(i);
    CHECK(line->difference_N[i] ==
          Approx(coarse.response[k] - fine.response[k]).margin(1e-4 * budget.peak_N));
  }
  double sum = 0.0;
  for (const BudgetLine& each : budget.lines) sum += each.difference_N.back();
  CHECK(sum == Approx(budget.stages.back().force_N.back() - budget.stages.front().force_N.back())
                   .margin(1e-12 * budget.peak_N));
  CHECK(budget.not_closed < 1e-12);
}

TEST_CASE("a finer scene of another material is refused") {
  Json paper = cube(6, "20 mm");
  paper["bonds"]["spacing_law"] = "paper";
  CHECK_THAT(test::refusal_of([&] { (void)budget_of_cubes(cube(4, "30 mm"), paper); }),
             Contains("times as stiff at 0.6667 times the spacing") &&
                 Contains("\"reference_spacing\": \"30 mm\""));
  CHECK_THAT(test::refusal_of([&] { (void)budget_of_cubes(cube(4, "30 mm"), cube(4, "30 mm")); }),
             Contains("a smaller one"));
}

}  // namespace tpm::fit
