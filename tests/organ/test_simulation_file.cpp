// The program tpm simulate: its files, its answers, and what becomes of it when it is stopped.
#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <set>

#include "simulated_scene.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/organ/run/simulation_file.hpp"
#include "tpm/plan/show/simulation_report.hpp"
#include "tpmkit/version.hpp"

using namespace tpm;
using namespace tpm::plan;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using test::run_of;
using test::small_scene;
using test::TempFolder;

namespace {

const std::string kShallowPush =
    R"("protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s",
  "hold": "2 s"}, "outputs": {"count": 4})";

void write_scene(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// The exit code of a shell command.
int exit_code(const std::string& command) {
  const int status = std::system(command.c_str());
  REQUIRE(WIFEXITED(status));
  return WEXITSTATUS(status);
}

/// What a shell is told to simulate a scene.
std::string command_for(const std::string& scene, const std::string& output,
                        const std::string& more) {
  return fmt::format("\"{}\" simulate \"{}\" -o \"{}\" {}", TPM_TEST_PROGRAM, scene, output, more);
}

/// Starts the program, waits for its first checkpoint, sends a signal.
/// @return its exit code, as a shell states it
int stop_after_checkpoint(const std::string& scene, const std::string& output,
                          const std::string& signal) {
  return exit_code(fmt::format(
      "exec 2>/dev/null; {} & p=$!; while kill -0 $p && [ ! -e \"{}.checkpoint\" ]; do sleep 0.01; "
      "done; kill -{} $p; wait $p",
      command_for(scene, output, "--checkpoint-every '1 us' >/dev/null"), output, signal));
}

std::set<std::string> keys_of(const Json& json) {
  std::set<std::string> keys;
  if (json.is_array()) {
    for (const Json& entry : json) keys.merge(keys_of(entry));
  }
  if (!json.is_object()) return keys;
  for (const auto& [key, value] : json.items()) {
    keys.insert(key);
    keys.merge(keys_of(value));
  }
  return keys;
}

}  // namespace

TEST_CASE("a run tells once that a scene without E and without a spacing law keeps the paper's") {
  const TempFolder folder;
  const auto told = [&](const std::string& bonds) {
    const std::string scene = folder / "s.json";
    write_scene(scene, R"({"organ": {"kind": "block", "cells": [3, 3, 3], "spacing": "20 mm"},)" +
                           bonds +
                           R"("anchors": [{"kind": "inner_layer"}],
                "contacts": [{"kind": "sphere", "number": 30}],)" +
                           kShallowPush + "}");
    const std::string errors = folder / "errors.txt";
    REQUIRE(exit_code(command_for(scene, folder / "out.h5", ">/dev/null 2>") + "'" + errors +
                      "'") == 0);
    const std::string text = std::filesystem::file_size(errors) > 0 ? read_file(errors) : "";
    const std::regex words("assumed: spacing law paper");
    return std::distance(std::sregex_iterator(text.begin(), text.end(), words), {});
  };
  CHECK(told("") == 1);
  CHECK(told(R"("bonds": {"spacing_law": "paper"},)") == 0);
  // In JSON it is a remark.
  REQUIRE(exit_code(command_for(folder / "s.json", folder / "b.h5",
                                "--format json >'" + (folder / "b.json") + "'")) == 0);
  CHECK(parse_json(read_file(folder / "b.json"), "answer").at("remarks").empty());
  CHECK(told("") == 1);
  REQUIRE(exit_code(command_for(folder / "s.json", folder / "c.h5",
                                "--format json >'" + (folder / "c.json") + "'")) == 0);
  const Json remarks = parse_json(read_file(folder / "c.json"), "answer").at("remarks");
  REQUIRE(remarks.size() == 1);
  CHECK(remarks.front().at("code") == kSpacingLawKept);
}

TEST_CASE("the file of a run holds its scene, version, tolerance, and what was found", "[heavy]") {
  const TempFolder folder;
  const ExperimentScene scene = small_scene(kShallowPush + R"(, "title": "a push")");
  const RunNetwork network = network_to_run(scene);
  const SimulationRun run = simulate(scene, network);
  const auto xdmf = write_simulation(scene, network, run, folder / "a.h5");
  const Hdf5Reader file(folder / "a.h5");
  CHECK(file.attribute("/", "scene") == scene.text);
  CHECK(file.attribute("/", "scene_sha256") == sha256_hex(scene.text));
  CHECK(file.attribute("/", "version") == version());
  CHECK(file.number_attribute("/", "tolerance") == 1e-6);
  CHECK(file.attribute("/", "formulation") == "quasi_static");
  CHECK(file.attribute("/", "network") == "tissue");
  CHECK(file.attribute("/", "title") == "a push");
  CHECK(file.numbers("/steps/time_s") == std::vector<double>{0.0, 1.0, 2.0, 3.0});
  CHECK(file.numbers("/curve/time_s").size() == run.record.curve.size());
  CHECK(file.numbers("/curve/force_N").back() == run.record.curve.back().response);
  CHECK(file.number_attribute("/validity/indentation_over_12_mm", "passed") == 0.0);
  // Forces balance on free spheres; the probe holds its own with the contact force.
  const std::vector<double> force = file.table("/steps/00003/force_N");
  const Constraints constraints = scene.tissue.constraints();
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    const Eigen::Vector3d on_sphere(&force[3 * i]);
    if (i == scene.probe().sphere) {
      CHECK_THAT(-on_sphere.dot(scene.probe().direction),
                 WithinAbs(run.record.curve.back().response, 1e-6));
    } else if (constraints.is_free(i)) {
      CHECK(on_sphere.norm() < 1e-6);
    }
  }
  // The XDMF names what is there, and the same scene gives the same bytes.
  const std::string text = read_file(xdmf);
  const std::regex reference("a\\.h5:([^<]+)<");
  std::set<std::string> named;
  for (auto it = std::sregex_iterator(text.begin(), text.end(), reference);
       it != std::sregex_iterator(); ++it) {
    named.insert((*it)[1]);
  }
  CHECK(named.size() > 24);  // four times, at least six each
  for (const std::string& name : named) CHECK(file.has(name));
  write_simulation(scene, network, run_of(scene), folder / "b.h5");
  CHECK(read_file(folder / "a.h5") == read_file(folder / "b.h5"));
}

TEST_CASE("every key of the JSON answer is described in docs/data_formats.md", "[heavy]") {
  const std::string formats = read_file(std::string(TPM_TEST_SOURCE_DIR) + "/docs/data_formats.md");
  const std::size_t begin = formats.find("\n### The JSON output\n");
  REQUIRE(begin != std::string::npos);
  const std::string page = formats.substr(begin, formats.find("\n### ", begin + 1) - begin);
  const ExperimentScene deep = small_scene(
      R"("protocol": {"kind": "ramp_hold", "depth": "13 mm", "rate": "4 mm/s", "hold": "1 s"})");
  for (const std::string& key :
       keys_of(simulation_json(deep, network_to_run(deep), run_of(deep)))) {
    CAPTURE(key);
    CHECK(page.find("`" + key + "`") != std::string::npos);
  }
}

TEST_CASE("the JSON says how deep tools come into spheres, which the text says") {
  const std::string protocol =
      R"("protocol": {"kind": "ramp_hold", "depth": "3 mm", "rate": "4 mm/s", "hold": "1 s"})";
  const ExperimentScene bare = small_scene(protocol);
  CHECK(simulation_json(bare, network_to_run(bare), run_of(bare))["largest_overlap_m"].is_null());
  const ExperimentScene ball =
      small_scene(R"("contacts": [{"kind": "ball", "radius": "20 mm"}], )" + protocol);
  const SimulationRun run = run_of(ball);
  const Json json = simulation_json(ball, network_to_run(ball), run);
  double most = 0.0;
  for (const CurvePoint& p : run.record.curve) most = std::max(most, p.overlap_m);
  REQUIRE(most > 0.0);
  CHECK_THAT(json["largest_overlap_m"].get<double>(), Catch::Matchers::WithinRel(most, 1e-2));
}

TEST_CASE("a run that is stopped, by whatever signal, ends as one that was not", "[heavy]") {
  const TempFolder folder;
  // Large enough for a checkpoint to be seen before the end.
  write_scene(folder / "s.json", R"({"organ": {"kind": "liver", "count": 1500},
    "protocol": {"kind": "ramp_hold", "depth": "6 mm", "rate": "4 mm/s", "hold": "3 s"},
    "material": {"eta1": "16800 Pa s"}, "outputs": {"count": 3}})");
  const std::string scene = folder / "s.json";
  REQUIRE(exit_code(command_for(scene, folder / "whole.h5", ">/dev/null")) == 0);
  for (const auto& [signal, code] : {std::pair{"INT", 130}, {"TERM", 143}, {"KILL", 137}}) {
    CAPTURE(signal);
    const std::string result = folder / (std::string(signal) + ".h5");
    const std::string checkpoint = result + ".checkpoint";
    CHECK(stop_after_checkpoint(scene, result, signal) == code);
    CHECK_FALSE(std::filesystem::exists(result));
    REQUIRE(std::filesystem::exists(checkpoint));
    const std::string told = folder / "told";
    REQUIRE(exit_code(command_for(scene, result, fmt::format(">\"{}\"", told))) == 0);
    CHECK_THAT(read_file(told), Contains("resumed at"));
    CHECK_FALSE(std::filesystem::exists(checkpoint));
    CHECK(read_file(result) == read_file(folder / "whole.h5"));
  }
}

TEST_CASE("nothing is said on standard error where that is no terminal") {
  const TempFolder folder;
  write_scene(folder / "s.json", test::small_scene_text(kShallowPush));
  REQUIRE(exit_code(command_for(
              folder / "s.json", folder / "a.h5",
              fmt::format("--format json >\"{}\" 2>\"{}\"", folder / "out", folder / "err"))) == 0);
  CHECK(std::filesystem::file_size(folder / "err") == 0);
  const Json json = parse_json(read_file(folder / "out"), "answer");
  CHECK(json.at("scene_sha256") == sha256_hex(read_file(folder / "s.json")));
  CHECK(json.at("last").at("imposed").get<double>() == 0.004);
  CHECK(json.at("files").size() == 2);
}

TEST_CASE("tissue and mass-spring model are run and drawn beside each other, twice the same",
          "[heavy]") {
  const TempFolder folder;
  write_scene(folder / "s.json", test::small_scene_text(kShallowPush));
  for (const std::string name : {"a", "b"}) {
    REQUIRE(exit_code(command_for(
                folder / "s.json", folder / (name + ".h5"),
                fmt::format("--beside-mass-spring --folder \"{0}\" --format json >\"{0}.json\"",
                            folder / name))) == 0);
  }
  const Json json = parse_json(read_file(folder / "a.json"), "answer");
  CHECK(json.at("network") == "tissue");
  CHECK(json.at("mass_spring").at("network") == "mass_spring");
  CHECK(Hdf5Reader(folder / "a-mass_spring.h5").attribute("/", "network") == "mass_spring");
  for (const char* name :
       {"undeformed", "deformed", "displacement", "force", "validity", "side_by_side"}) {
    CAPTURE(name);
    const std::string picture = std::string("/") + name;
    CHECK(read_file((folder / "a") + picture + ".svg") ==
          read_file((folder / "b") + picture + ".svg"));
    CHECK(read_file((folder / "a") + picture + ".png").starts_with("\x89PNG"));
    CHECK(read_file((folder / "a") + picture + ".pdf").starts_with("%PDF"));
  }
}
