// Contacts with protocols of their own, loads that stay, and anchors that slide.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tpm/files/json.hpp"
#include "tpm/organ/body/outer_area.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/run/simulation.hpp"
#include "tpm/organ/scene/inspection.hpp"
#include "tpmkit/error.hpp"

using namespace tpm;
using namespace tpm::organ;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

Json block_scene() {
  return parse_json(R"({
    "organ": {"kind": "block", "cells": [3, 3, 2], "spacing": "10 mm"},
    "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "24 kPa s"},
    "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "0.1 mm"], "normal": [0, 0, -1]}],
    "outputs": {"count": 11}})",
                    "scene");
}

ExperimentScene parsed_scene(const Json& json) {
  return parse_experiment(json, "scene", {});
}

/// The two upper corners' numbers: free spheres.
std::pair<std::size_t, std::size_t> two_upper_spheres() {
  Json json = block_scene();
  const Tissue tissue = parse_tissue(json, "scene", {});
  const Positions& at = tissue.network.organ.position;
  Eigen::Index first = 0, second = 0;
  (at.row(2) + 1e-3 * at.row(0) + 1e-4 * at.row(1)).maxCoeff(&first);
  (at.row(2) - 1e-3 * at.row(0) - 1e-4 * at.row(1)).maxCoeff(&second);
  REQUIRE(first != second);
  return {static_cast<std::size_t>(first) + 1, static_cast<std::size_t>(second) + 1};
}

Json pushed_sphere(std::size_t number) {
  return {{"kind", "sphere"}, {"number", number}, {"direction", {0, 0, -1}}};
}

const Json kRamp = parse_json(
    R"({"kind": "ramp_hold", "depth": "2 mm", "rate": "4 mm/s", "hold": "2 s"})", "ramp");
const Json kLoadProtocol = parse_json(R"({"kind": "knots", "knots": [{"time": "0 s", "load": "0 N"},
    {"time": "0.8 s", "load": "0.02 N"}, {"time": "2 s", "load": "0.005 N"}]})",
                                      "load");

/// One sphere goes to a depth and another bears a load, under gravity.
Json depth_beside_load() {
  const auto [first, second] = two_upper_spheres();
  Json json = block_scene();
  json["contacts"] = {pushed_sphere(first), pushed_sphere(second)};
  json["contacts"][0]["protocol"] = kRamp;
  json["contacts"][1]["protocol"] = kLoadProtocol;
  json["loads"] = {{{"kind", "gravity"}, {"direction", {0, 0, -1}}}};
  return json;
}

}  // namespace

TEST_CASE("contacts with equal protocols of their own answer as contacts that share one") {
  const auto [first, second] = two_upper_spheres();
  Json shared = block_scene();
  shared["contacts"] = {pushed_sphere(first), pushed_sphere(second)};
  shared["protocol"] = kRamp;
  Json own = block_scene();
  own["contacts"] = {pushed_sphere(first), pushed_sphere(second)};
  for (Json& one : own["contacts"]) one["protocol"] = kRamp;
  const ExperimentScene together = parsed_scene(shared), apart = parsed_scene(own);
  CHECK_FALSE(together.has_own_protocols());
  CHECK(apart.has_own_protocols());
  const SimulationRun a = simulate(together, network_to_run(together));
  const SimulationRun b = simulate(apart, network_to_run(apart));
  REQUIRE(a.record.curve.size() == b.record.curve.size());
  double peak = 0.0;
  for (const CurvePoint& p : a.record.curve) peak = std::max(peak, p.response);
  REQUIRE(peak > 0.0);
  for (std::size_t i = 0; i < a.record.curve.size(); ++i) {
    const CurvePoint& p = b.record.curve[i];
    REQUIRE(p.beside.size() == 1);
    CHECK_THAT(p.response + p.beside[0], WithinAbs(a.record.curve[i].response, 3e-6 * peak));
    CHECK_THAT(p.imposed, WithinAbs(a.record.curve[i].imposed, 1e-12));
  }
}

TEST_CASE("the energy of a depth beside a load, under gravity, is accounted for") {
  const ExperimentScene scene = parsed_scene(depth_beside_load());
  CHECK_THAT(scene.protocol.end_s(), WithinRel(2.5, 1e-12));
  const SimulationRun run = simulate(scene, network_to_run(scene));
  const QuasiStaticEnergy& end = run.record.curve.back().energy;
  CHECK(end.work_J > 0.0);
  CHECK(end.dissipated_J > 0.0);
  CHECK_THAT(end.work_J, WithinAbs(end.stored_J + end.dissipated_J, 1e-5 * end.work_J));
  // Under the load the second contact goes in, and it is let go to a quarter of it.
  CHECK(run.record.curve.back().beside.at(0) > 0.0);
}

TEST_CASE("anchors bear the weight of a sagged block, and nothing has to relax at the start") {
  const std::size_t first = two_upper_spheres().first;
  Json json = block_scene();
  json["contacts"] = {pushed_sphere(first)};
  json["protocol"] = parse_json(R"({"kind": "knots", "knots": [{"time": "0 s", "depth": "0 mm"},
      {"time": "3 s", "depth": "0 mm"}, {"time": "4 s", "depth": "1 mm"}]})",
                                "protocol");
  json["loads"] = {{{"kind", "gravity"}, {"direction", {0, 0, -1}}, {"mass_kg", 0.05}}};
  const ExperimentScene scene = parsed_scene(json);
  const RunNetwork network = network_to_run(scene);
  const Loading& loading = network.driven.probes.loading();
  CHECK_THAT(loading.dead_N.row(2).sum(), WithinRel(-0.05 * 9.80665, 1e-12));
  CHECK((network.driven.rest.row(2) - loading.unloaded.row(2)).minCoeff() < -1e-5);
  const SimulationRun run = simulate(scene, network);
  const double peak = run.record.curve.back().response;
  for (const CurvePoint& p : run.record.curve) {
    if (p.time_s <= 3.0) CHECK_THAT(p.response, WithinAbs(0.0, 1e-6 * peak));
  }
  // What bonds exert on the anchors is the weight, until the contact takes a part of it.
  const QuasiStaticState& start = run.record.outputs.front();
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, start.position.cols());
  network.driven.bonds.add_forces(start.position,
                                  {network.driven.bonds.mean_viscous(start.viscous), 0.0}, force);
  Eigen::Vector3d on_anchors = Eigen::Vector3d::Zero(), on_themselves = Eigen::Vector3d::Zero();
  for (const std::size_t anchor : scene.tissue.anchors) {
    on_anchors += force.col(static_cast<Eigen::Index>(anchor));
    on_themselves += loading.dead_N.col(static_cast<Eigen::Index>(anchor));
  }
  const Eigen::Vector3d weight = loading.dead_N.rowwise().sum();
  CHECK_THAT((on_anchors + on_themselves - weight).norm(), WithinAbs(0.0, 1e-9 * weight.norm()));
}

TEST_CASE("a sagged network can be given masses: light spheres move as without them") {
  Json json = depth_beside_load();
  const ExperimentScene massless = parsed_scene(json);
  json["formulation"] = {{"kind", "inertial"}, {"density_kg_per_m3", 0.01}, {"damping_ratio", 1.0}};
  const ExperimentScene light = parsed_scene(json);
  const SimulationRun a = simulate(massless, network_to_run(massless));
  const SimulationRun b = simulate(light, network_to_run(light));
  const auto at = [](const SimulationRun& run, double time_s) -> const CurvePoint& {
    for (const CurvePoint& p : run.record.curve) {
      if (p.time_s >= time_s) return p;
    }
    return run.record.curve.back();
  };
  double peak = 0.0, deepest = 0.0;
  for (const CurvePoint& p : a.record.curve) {
    peak = std::max(peak, p.response);
    deepest = std::max(deepest, std::abs(p.beside[0]));
  }
  for (const double time_s : {0.25, 0.4, 1.0, 1.5, 2.2}) {
    CAPTURE(time_s);
    CHECK_THAT(at(b, time_s).response, WithinAbs(at(a, time_s).response, 2e-3 * peak));
    CHECK_THAT(at(b, time_s).beside[0], WithinAbs(at(a, time_s).beside[0], 2e-3 * deepest));
  }
  REQUIRE(b.record.inertial_energy);
  const InertialEnergy& energy = *b.record.inertial_energy;
  CHECK_THAT(energy.missing(), WithinAbs(0.0, 1e-3 * std::abs(energy.work)));
}

TEST_CASE("a run with two protocols and gravity goes on from a checkpoint to the bit") {
  const ExperimentScene scene = parsed_scene(depth_beside_load());
  const RunNetwork network = network_to_run(scene);
  const SimulationRun whole = simulate(scene, network);
  SimulationControls controls;
  controls.checkpoint = std::string(TPM_TEST_BINARY_DIR) + "/loading.checkpoint";
  std::filesystem::remove(controls.checkpoint);
  controls.checkpoint_every_s = 0.0;
  std::size_t seen = 0;
  controls.interrupted = [&] { return ++seen == 150; };
  CHECK_THROWS_AS(simulate(scene, network, controls), Interrupted);
  controls.interrupted = nullptr;
  const SimulationRun resumed = simulate(scene, network, controls);
  REQUIRE(resumed.resumed_at_s);
  REQUIRE(resumed.record.curve.size() == whole.record.curve.size());
  for (std::size_t i = 0; i < whole.record.curve.size(); ++i) {
    CHECK(resumed.record.curve[i].response == whole.record.curve[i].response);
    CHECK(resumed.record.curve[i].beside == whole.record.curve[i].beside);
  }
  std::filesystem::remove(controls.checkpoint);
}

TEST_CASE("a half-space that slides holds the motion along its normal alone") {
  Json json = block_scene();
  json["anchors"][0]["slides"] = true;
  json["anchors"].push_back({{"kind", "half_space"},
                             {"point", {"0.1 mm", "0 mm", "0 mm"}},
                             {"normal", {-1, 0, 0}},
                             {"slides", true}});
  // An edge would slide on two planes.
  CHECK_THROWS_WITH(parse_tissue(json, "scene", {}), Contains("slides on two planes"));
  json["anchors"].erase(1);
  const Tissue sliding = parse_tissue(json, "scene", {});
  CHECK_THROWS_WITH(require_standing(sliding, "scene"), Contains("not anchored"));
  json["anchors"].push_back({{"kind", "spheres"}, {"spheres", {1, 4}}});
  const Tissue tissue = parse_tissue(json, "scene", {});
  require_standing(tissue, "scene");
  const Constraints constraints = tissue.constraints();
  std::size_t in_plane = 0;
  for (std::size_t i = 0; i < tissue.network.organ.size(); ++i) {
    const Eigen::Matrix3d& free = constraints.projector(i);
    if (std::abs(free.trace() - 2.0) > 1e-9) continue;
    ++in_plane;
    CHECK_THAT((free * Eigen::Vector3d::UnitZ()).norm(), WithinAbs(0.0, 1e-12));
  }
  CHECK(in_plane >= 14);
}

TEST_CASE("the areas of the outer spheres are those of the surface") {
  Organ organ;
  const Eigen::Index count = 600;
  const double radius = 0.05;
  organ.position.resize(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {  // Fibonacci's lattice
    const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count);
    const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * static_cast<double>(i);
    const double across = std::sqrt(1.0 - z * z);
    organ.position.col(i) << across * std::cos(angle), across * std::sin(angle), z;
  }
  organ.normal = organ.position;
  organ.position *= radius;
  organ.layer.assign(static_cast<std::size_t>(count), 0);
  const double surface = 4.0 * std::numbers::pi * radius * radius;
  organ.spacing = std::sqrt(surface / static_cast<double>(count) * 2.0 / std::sqrt(3.0));
  organ.radius = 0.5 * organ.spacing;
  CHECK_THAT(outer_areas_m2(organ).sum(), WithinRel(surface, 0.01));
}

TEST_CASE("a tissue of a stated modulus has it, and no other Poisson ratio than its network's",
          "[heavy]") {
  Json json = block_scene();
  json["organ"] = parse_json(R"({"kind": "liver", "count": 3000, "filling": "solid"})", "organ");
  json["anchors"] = {{{"kind", "far_side"}}};
  json["material"]["E"] = "3 kPa";
  const Tissue tissue = parse_tissue(json, "scene", {});
  CHECK(tissue.network.options.spacing_law == SpacingLaw::continuum);
  const NetworkInspection found = inspect(tissue);
  REQUIRE(found.equilibrium);
  CHECK_THAT(found.equilibrium->mean_young_Pa(), WithinRel(3000.0, 1e-9));
  json["material"]["nu"] = 0.49;
  CHECK_THROWS_WITH(parse_tissue(json, "scene", {}), Contains("28 % more force"));
  json["material"]["nu"] = std::round(100.0 * found.equilibrium->poisson) / 100.0;
  CHECK_NOTHROW(parse_tissue(json, "scene", {}));
  json["bonds"] = {{"spacing_law", "paper"}};
  CHECK_THROWS_WITH(parse_tissue(json, "scene", {}), Contains("spacing_law"));
  Json shell = block_scene();
  shell["material"]["E"] = "3 kPa";
  CHECK_THROWS_WITH(parse_tissue(shell, "scene", {}), Contains("no inside"));
}

TEST_CASE("the inside of a block of cells has the moduli of its lattice in closed form") {
  // Sums over the first and second neighbours of a lattice whose bonds are alike.
  struct Case {
    const char* lattice;
    int cells;
    double poisson, anisotropy;
  };
  for (const Case& c : {Case{"cubic", 8, 1.0 / 4.0, 1.0}, Case{"bcc", 8, 1.0 / 5.0, 2.0 / 3.0},
                        Case{"fcc", 6, 1.0 / 7.0, 2.0 / 5.0}}) {
    CAPTURE(c.lattice);
    Json json = block_scene();
    json["organ"] = {{"kind", "block"},
                     {"cells", {c.cells, c.cells, c.cells}},
                     {"spacing", "10 mm"},
                     {"lattice", c.lattice}};
    json["material"] = {{"E", "3 kPa"}};
    json["bonds"] = {{"rule", "per_bond"}};
    const NetworkInspection found = inspect(parse_tissue(json, "scene", {}));
    REQUIRE(found.equilibrium);
    CHECK_THAT(found.equilibrium->mean_young_Pa(), WithinRel(3000.0, 1e-9));
    REQUIRE(found.instantaneous);
    CHECK_THAT(found.instantaneous->poisson, WithinRel(c.poisson, 1e-6));
    CHECK_THAT(found.instantaneous->anisotropy, WithinRel(c.anisotropy, 1e-6));
  }
}

TEST_CASE("a scene that states neither E nor a spacing law is told which law it has") {
  const auto told = [](const Json& json) {
    return std::ranges::any_of(
        parse_tissue(json, "scene", {}).network.organ.assumptions,
        [](const Remark& assumption) { return assumption.code == "spacing_law_paper"; });
  };
  Json json = block_scene();
  CHECK(told(json));
  json["bonds"] = {{"spacing_law", "paper"}};
  CHECK_FALSE(told(json));
}

TEST_CASE("a pressure that pulls is told with the sign of what it sums to") {
  Json json = block_scene();
  json["contacts"] = {pushed_sphere(two_upper_spheres().first)};
  json["protocol"] = kRamp;
  const auto words = [&](const char* pressure) {
    json["loads"] = {{{"kind", "pressure"}, {"pressure", pressure}}};
    return parsed_scene(json).load_words.at(0);
  };
  CHECK_THAT(words("-10 Pa"), StartsWith("pressure of -10 Pa on ") && Contains(" cm^2: -0."));
  CHECK_THAT(words("10 Pa"), StartsWith("pressure of 10 Pa on ") && Contains(" cm^2: 0."));
}

TEST_CASE("a sphere that two contacts drive is refused by file and contact") {
  Json json = block_scene();
  json["protocol"] = kRamp;
  json["contacts"] = {pushed_sphere(two_upper_spheres().first),
                      pushed_sphere(two_upper_spheres().second)};
  CHECK_NOTHROW(parsed_scene(json));
  json["contacts"][1] = json["contacts"][0];
  CHECK_THROWS_WITH(parsed_scene(json), Contains("/contacts/1: drives sphere ") &&
                                            Contains("which contact /contacts/0 drives too"));
}

TEST_CASE("scenes with several protocols that make no sense are refused") {
  const auto [first, second] = two_upper_spheres();
  Json json = block_scene();
  json["contacts"] = {pushed_sphere(first), pushed_sphere(second)};
  json["contacts"][0]["protocol"] = kRamp;
  CHECK_THROWS_WITH(parsed_scene(json), Contains("/contacts/1/protocol") && Contains("is missing"));
  json["protocol"] = kRamp;  // which nothing would follow
  CHECK_THROWS_WITH(parsed_scene(json), Contains("key /protocol: is of no contact"));
  json.erase("protocol");
  json["contacts"][1]["protocol"] = parse_json(
      R"({"kind": "knots", "knots": [{"time": "1 s", "depth": "0 mm"}, {"time": "2 s", "depth": "1 mm"}]})",
      "late");
  CHECK_THROWS_WITH(parsed_scene(json), Contains("begins at 1 s"));
  json["contacts"][1]["protocol"] = kLoadProtocol;
  json["contacts"][1]["share"] = 0.5;
  CHECK_THROWS_WITH(parsed_scene(json), Contains("is of no protocol"));
  json["contacts"][1].erase("share");
  json["formulation"] = {{"kind", "static"}};
  const ExperimentScene scene = parsed_scene(json);
  CHECK_THROWS_WITH(require_runnable(scene), Contains("protocols of their own"));
}
