// Any parameter of a material by its name in the table: sweeps set it, fits estimate it.
#include <catch2/catch.hpp>
#include <cmath>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/fit/fit.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/scene/organ_model.hpp"
#include "tpm/sweep/sweep_keys.hpp"

using namespace tpm;
using namespace tpm::sweep;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Two branches, a potential that stiffens, and a region, so that no name can reach the wrong
/// place.
const char* const kScene = R"({"organ": {"kind": "block", "cells": [2, 2, 2], "spacing": "20 mm",
    "lattice": "cubic", "contact": 5},
  "anchors": [{"kind": "inner_layer"}],
  "material": {"Einf": "5 kPa", "Eprime": "9 kPa", "potential": {"shape": "cubic", "stiffening": "6 mm"},
    "branches": [{"g": "3 kPa", "tau": "0.4 s"}, {"g": "2 kPa", "tau": "3 s"}],
    "regions": [{"kind": "spheres", "spheres": [6], "factor": 2}]},
  "protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "4 mm/s", "hold": "2 s"},
  "tolerance": 1e-7})";

/// Of sweeps whose cells end with a force.
std::shared_ptr<const SweepModel> swept_model(const Json& scene) {
  const Json document{{"model", "organ"}, {"scene", scene}, {"outputs", {"end_force"}}};
  return organ_sweep_model(sweep_kinds().made(document, {"s.json"}), "s.json", {});
}

/// The last force of each cell of a sweep over one target.
std::vector<double> swept_forces(const Json& scene, const std::string& target,
                                 const std::vector<double>& values) {
  const auto model = swept_model(scene);
  const auto [least, largest] = std::minmax_element(values.begin(), values.end());
  const auto cell = model->cell_model({{target, 0, values.size(), *least, *largest}});
  std::vector<double> forces;
  std::vector<std::int64_t> counts(model->counted().size());
  for (const double value : values) {
    double force = 0.0;
    static_cast<void>(cell->run({&value, 1}, {&force, 1}, counts));
    forces.push_back(force);
  }
  return forces;
}

/// The same of a scene whose file says the value.
double force_of(const Json& scene) {
  const ExperimentScene read = parse_experiment(scene, "s.json", {});
  return run_scene(read, {read.protocol.end_s()}, false).response[0];
}

Json with_text(const char* pointer, const char* text) {
  Json scene = parse_json(kScene, "scene");
  scene.at(Json::json_pointer(pointer)) = text;
  return scene;
}

}  // namespace

TEST_CASE("a sweep sets a parameter by its name as the scene's file does") {
  const Json scene = parse_json(kScene, "scene");
  struct Named {
    const char* name;
    double value;
    const char* pointer;
    const char* text;
  };
  const double before = force_of(scene);
  for (const Named& n :
       {Named{"material.Einf", 4e3, "/material/Einf", "4 kPa"},
        Named{"material.Eprime", 5e3, "/material/Eprime", "5 kPa"},
        Named{"material.g1", 1e3, "/material/branches/0/g", "1 kPa"},
        Named{"material.tau2", 1.5, "/material/branches/1/tau", "1.5 s"},
        Named{"material.stiffening", 3e-3, "/material/potential/stiffening", "3 mm"},
        Named{"material.l0", 2e-3, "", ""}}) {
    CAPTURE(n.name);
    // The cell before must leave nothing behind.
    const std::vector<double> found = swept_forces(scene, n.name, {1.25 * n.value, n.value});
    Json said = scene;
    if (*n.pointer != '\0') {
      said = with_text(n.pointer, n.text);
    } else {
      said["material"]["l0"] = "2 mm";
    }
    CHECK_THAT(found[1], WithinRel(force_of(said), 1e-5));
    CHECK(std::abs(found[1] / before - 1.0) > 1e-3);
    if (*n.pointer != '\0') {
      CHECK(swept_forces(scene, n.pointer, {n.value})[0] == found[1]);
    }
  }
}

TEST_CASE("a sweep says which parameters a material has, and what a value may be") {
  const Json scene = parse_json(kScene, "scene");
  const auto refusal = [&](const std::string& target, double value) {
    return test::refusal_of([&] { static_cast<void>(swept_forces(scene, target, {value})); });
  };
  CHECK(refusal("material.tau3", 1.0) ==
        "sweep: 'material.tau3' is no parameter of the material; expected one of material.Einf, "
        "material.Eprime, material.stiffening, material.g1, material.tau1, material.g2, "
        "material.tau2, material.A0, material.l0");
  CHECK(refusal("material.tau1", 0.0) == "material.tau1: tau1 = 0 s; expected above 0");
  CHECK(refusal("/material/E1", 1.0).find("is not in the scene") != std::string::npos);
  const auto model = swept_model(scene);
  CHECK(model->dimension_of("material.tau2", "here") == Dimension::time);
  CHECK(model->dimension_of("material.g2", "here") == Dimension::stress);
  CHECK(model->dimension_of("material.stiffening", "here") == Dimension::length);
}

TEST_CASE("a fit on an organ finds a parameter by its name in the table", "[heavy]") {
  const test::TempFolder folder;
  Json scene = parse_json(kScene, "scene");
  scene.erase("protocol");
  scene.erase("tolerance");
  write_file(folder / "scene.json", to_text(scene));
  const Tissue tissue = parse_tissue(scene, "scene", {});
  // Readings of the organ itself at other values than the scene's.
  const OrganModel organ(std::make_shared<const Tissue>(tissue));
  std::vector<double> true_values = organ.own_values();
  const auto place = [&](std::string_view name) {
    for (std::size_t i = 0; i < true_values.size(); ++i) {
      if (organ.parameters()[i].name == name) return i;
    }
    throw std::logic_error("no such parameter");
  };
  constexpr double kTau2_s = 5.5, kG1_Pa = 4.2e3;
  true_values[place("tau2")] = kTau2_s;
  true_values[place("g1")] = kG1_Pa;
  const std::vector<double> times{0.0, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0};
  const Protocol protocol = step_and_hold(3e-3, 16.0);
  const Eigen::VectorXd force = organ.respond(protocol, times, true_values, Want::values).value;
  std::string csv = "depth_mm,time_s,force_N,provenance\n";
  for (std::size_t i = 0; i < times.size(); ++i) {
    csv += "3," + shortest(times[i]) + "," + shortest(force[static_cast<Eigen::Index>(i)]) +
           ",derived\n";
  }
  write_file(folder / "made.csv", csv);
  write_file(folder / "made.json", R"({"id": "made", "title": "made", "kind": "points",
    "observable": "contact_force", "time_origin": "end_of_ramp",
    "columns": {"depth_mm": {"quantity": "indentation_depth", "unit": "mm"},
                "time_s": {"quantity": "time", "unit": "s"},
                "force_N": {"quantity": "contact_force", "unit": "N"}}})");
  const Json config = parse_json(R"({"title": "t", "model": "organ", "scene": "scene.json",
    "parameters": {"tau2": {"start": "3 s", "lower": "1 s", "upper": "30 s"},
                   "g1": {"start": "3 kPa", "lower": "1 kPa", "upper": "9 kPa"}},
    "data": [{"dataset": "made.csv", "protocol": {"kind": "step_hold"},
              "noise": {"kind": "relative_to_datum", "relative": 0.01}}],
    "starts": {"count": 1}, "profile": {"enabled": false}})",
                                 "f.json");
  const FitResult fit = run_fit(parse_fit_config(config, "f.json", folder.path()));
  REQUIRE(fit.best.natural.size() == 2);
  CHECK_THAT(fit.best.natural[0], WithinRel(kTau2_s, 1e-3));
  CHECK_THAT(fit.best.natural[1], WithinRel(kG1_Pa, 1e-3));
}
