// Several contacts and loads that stay, against an independent solver in numpy and scipy that reads
// the file of the network alone.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "python_reference.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/run/simulation.hpp"
#include "tpm/organ/scene/network_file.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::WithinAbs;
using tpm_test::python_reference;

namespace {

Json knots_of(const Protocol& protocol) {
  Json list = Json::array();
  for (const Knot& knot : protocol.knots()) list.push_back({knot.time_s, knot.value});
  return list;
}

/// What the reference is told of a scene.
Json asked_of(const ExperimentScene& scene) {
  Json asked{{"contacts", Json::array()}, {"steps", 40}};
  for (std::size_t i = 0; i < scene.contacts.size(); ++i) {
    const SceneContact& contact = scene.contacts[i];
    const Protocol& protocol = i == 0 ? scene.protocol : contact.protocol.value();
    Json spheres = Json::array();
    for (const std::size_t s : spheres_of(contact, scene.tissue.network.organ)) {
      spheres.push_back(s + 1);
    }
    const Eigen::Vector3d& d = contact.probe.direction;
    asked["contacts"].push_back(
        {{"spheres", spheres},
         {"direction", {d.x(), d.y(), d.z()}},
         {"drive", protocol.drive() == Drive::displacement ? "depth" : "load"},
         {"knots", knots_of(protocol)}});
  }
  if (scene.dead_load_N.size() == 0) return asked;
  asked["dead_N"] = Json::array();
  for (const auto& force : scene.dead_load_N.colwise()) {
    asked["dead_N"].push_back({force.x(), force.y(), force.z()});
  }
  return asked;
}

void check_against_reference(const Json& json, const std::string& name) {
  ExperimentScene scene = parse_experiment(json, "scene", {});
  const std::string folder = TPM_TEST_BINARY_DIR;
  const std::string file = folder + "/loading_" + name + ".h5";
  const std::string what = folder + "/loading_" + name + ".json";
  (void)write_network(scene.tissue, file);
  std::ofstream(what) << asked_of(scene).dump();
  const Json reference =
      python_reference("reference_contacts.py", fmt::format("'{}' '{}'", file, what));
  scene.outputs.times_s = reference.at("time_s").get<std::vector<double>>();
  scene.formulation.tolerance = 1e-8;
  const RunNetwork network = network_to_run(scene);
  const SimulationRun run = simulate(scene, network);
  const auto expected = reference.at("response").get<std::vector<std::vector<double>>>();
  for (std::size_t c = 0; c < expected.size(); ++c) {
    CAPTURE(name, c);
    double peak = 0.0, worst = 0.0;
    for (const double value : expected[c]) peak = std::max(peak, std::abs(value));
    REQUIRE(peak > 0.0);
    CHECK(reference.at("error").at(c).get<double>() < 1e-5 * peak);
    for (std::size_t i = 0; i < expected[c].size(); ++i) {
      const QuasiStaticState& state = run.record.outputs.at(i);
      const double own = c == 0 ? state.response : state.beside.at(c - 1);
      worst = std::max(worst, std::abs(own - expected[c][i]));
    }
    WARN(name << ", contact " << c + 1 << ": largest difference " << worst / peak
              << " of the peak");
    CHECK(worst < 1e-5 * peak);
  }
  const Positions& rest = scene.tissue.network.organ.position;
  double sag_m = 0.0;
  if (scene.dead_load_N.size() > 0) {
    sag_m = (loaded_positions(scene.tissue.bonds(), rest, scene.tissue.constraints(),
                              scene.dead_load_N) -
             rest)
                .colwise()
                .norm()
                .maxCoeff();
    REQUIRE(sag_m > 1e-5);
  }
  CHECK_THAT(reference.at("sag_m").get<double>(), WithinAbs(sag_m, 1e-7 * std::max(sag_m, 1e-6)));
}

Json scene_with(const std::string& changes) {
  Json json = parse_json(R"({
    "organ": {"kind": "block", "cells": [4, 3, 2], "spacing": "10 mm"},
    "material": {"Einf": "6 kPa", "Eprime": "9 kPa",
                 "branches": [{"g": "5 kPa", "tau": "0.4 s"}, {"g": "3 kPa", "tau": "5 s"}]},
    "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "0.1 mm"], "normal": [0, 0, -1]}],
    "outputs": {"count": 5}})",
                         "scene");
  json.merge_patch(parse_json(changes, "changes"));
  return json;
}

/// A shipped scene with spheres in place of its tools, which the reference does not know.
Json shipped_with_spheres(const std::string& name) {
  Json scene =
      parse_json(read_file(std::filesystem::path(TPM_TEST_SOURCE_DIR) / "configs" / name), name);
  for (Json& contact : scene["contacts"]) {
    contact["kind"] = "sphere";
    contact.erase("radius");
  }
  return scene;
}

}  // namespace

TEST_CASE(
    "an independent solver finds the forces of two spheres of the liver in different motion") {
  Json scene = shipped_with_spheres("two_indenters.json");
  // A sine has too many corners for the reference.
  scene["contacts"][1]["protocol"] = parse_json(R"({"kind": "knots", "knots": [
    {"time": "0 s", "depth": "0 mm"}, {"time": "1 s", "depth": "4 mm"},
    {"time": "2 s", "depth": "1 mm"}, {"time": "4 s", "depth": "3 mm"}]})",
                                                "sine");
  check_against_reference(scene, "liver");
}

TEST_CASE("an independent solver finds the force on a liver that sags") {
  check_against_reference(shipped_with_spheres("sagging_liver.json"), "sagging_liver");
}

TEST_CASE("an independent solver finds the forces of two spheres in different motion") {
  check_against_reference(scene_with(R"({"contacts": [
    {"kind": "sphere", "at": ["10 mm", "10 mm", "20 mm"], "direction": [0, 0, -1],
     "protocol": {"kind": "ramp_hold", "depth": "3 mm", "rate": "4 mm/s", "hold": "3 s"}},
    {"kind": "sphere", "at": ["30 mm", "20 mm", "20 mm"], "direction": [0.3, 0, -1],
     "protocol": {"kind": "knots", "knots": [{"time": "0 s", "depth": "0 mm"},
       {"time": "0.5 s", "depth": "2 mm"}, {"time": "1.5 s", "depth": "-1 mm"},
       {"time": "3 s", "depth": "1.5 mm"}]}}]})"),
                          "two");
}

TEST_CASE("an independent solver finds a depth beside a load on a sagged block that slides") {
  check_against_reference(scene_with(R"({
    "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "0.1 mm"], "normal": [0, 0, -1], "slides": true},
                {"kind": "spheres", "spheres": [1, 4]}],
    "loads": [{"kind": "gravity", "direction": [0.2, 0, -1], "mass_kg": 0.04}],
    "contacts": [
    {"kind": "sphere", "at": ["10 mm", "10 mm", "20 mm"], "direction": [0, 0, -1],
     "protocol": {"kind": "ramp_hold", "depth": "2 mm", "rate": "4 mm/s", "hold": "2 s"}},
    {"kind": "sphere", "at": ["30 mm", "20 mm", "20 mm"], "direction": [0, 0, -1],
     "protocol": {"kind": "knots", "knots": [{"time": "0 s", "load": "0 N"},
       {"time": "1 s", "load": "0.03 N"}, {"time": "2.5 s", "load": "0.01 N"}]}}]})"),
                          "sagged");
}
