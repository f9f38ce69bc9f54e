// The cheapest model per cell: claims against the network, the choice, and bits that do not depend
// on the order.
#include <catch2/catch.hpp>
#include <set>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/run/static_path.hpp"
#include "tpm/plan/shared_plan.hpp"
#include "tpm/sweep/run_sweep.hpp"
#include "tpm/sweep/sweep_reader.hpp"

using namespace tpm;
using namespace tpm::sweep;

namespace {

/// A block of tissue with a ramp and hold; 8 x 6 x 6 cells that share organ and moduli.
std::string shared_block(const std::string& tolerance, const std::string& own) {
  return R"({"model": "organ", "block": 9, )" + tolerance + R"("scene": {
    "organ": {"kind": "block", "cells": [4, 4, 3], "spacing": "20 mm", "lattice": "cubic"},
    "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "24 kPa s"},
    "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "1 mm"], "normal": [0, 0, -1]}],
    "contacts": [{"kind": "sphere", "number": 13}],
    "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s", "hold": "5 s"},
    "tolerance": )" +
         own + R"(},
  "axes": [{"parameter": "/material/eta1", "from": "6 kPa s", "to": "96 kPa s", "count": 8, "scale": "log"},
           {"parameter": "/protocol/rate", "from": "2 mm/s", "to": "4 mm/s", "count": 6},
           {"parameter": "/protocol/depth", "from": "3 mm", "to": "6 mm", "count": 6}],
  "outputs": ["peak_force", {"force_over": {"from": "0 s", "to": "5 s", "count": 26}, "name": "force"}]})";
}

Sweep parsed_block(const std::string& tolerance, const std::string& own = "1e-6") {
  return parse_sweep(parse_json(shared_block(tolerance, own), "sweep"), "sweep", ".");
}

/// A liver of 80 spheres whose dashpots let bonds creep for long: E2 is much larger than E1.
Json creeping_liver(const char* E1, const char* Eprime, const char* eta1, const char* hold) {
  return {
      {"organ",
       {{"kind", "liver"}, {"count", 80}, {"layers", 2}, {"spacing", "20 mm"}, {"seed", 1}}},
      {"material",
       {{"E1", E1},
        {"E2", "60 kPa"},
        {"Eprime", Eprime},
        {"eta1", eta1},
        {"A0", "12.56 mm^2"},
        {"l0", "1 mm"}}},
      {"anchors", {{{"kind", "far_side"}, {"fraction", 0.3}}}},
      {"contacts", {{{"kind", "sphere"}, {"number", 71}}}},
      {"protocol", {{"kind", "ramp_hold"}, {"depth", "4 mm"}, {"rate", "4 mm/s"}, {"hold", hold}}},
      {"tolerance", 1e-8}};
}

Sweep over_depths(const Json& scene, const char* from, const char* to, const char* forces_to,
                  const char* tolerance) {
  Json document{
      {"model", "organ"},
      {"scene", scene},
      {"block", 4},
      {"axes", {{{"parameter", "/protocol/depth"}, {"from", from}, {"to", to}, {"count", 48}}}},
      {"outputs",
       {"peak_force",
        {{"force_over", {{"from", "1 s"}, {"to", forces_to}, {"count", 200}}},
         {"name", "force"}}}}};
  if (tolerance != nullptr) document["tolerance"] = tolerance;
  return parse_sweep(document, "sweep", ".");
}

std::string least_result(const Sweep& sweep, const std::string& file, int workers) {
  SweepControls controls;
  controls.workers = workers;
  BlockLog log(log_path(file), sweep, {});
  static_cast<void>(run_sweep(sweep, log, controls));
  static_cast<void>(write_sweep(sweep, {&log}, file));
  return read_file(file);
}

}  // namespace

TEST_CASE("each cell is as near to the network as its model claims", "[heavy]") {
  const Sweep expected = parsed_block("", "1e-8");
  CellRunner network(expected);
  for (const char* tolerance : {"5 %", "0.5 %", "0.01 %"}) {
    const Sweep sweep = parsed_block(R"("tolerance": ")" + std::string(tolerance) + R"(", )");
    CellRunner least(sweep);
    std::set<int> used;
    const double bound = parse_quantity(tolerance, Dimension::dimensionless, "test");
    for (std::uint64_t b = 0; b < sweep.blocks(); b += 5) {
      const CellBlock found = least.run(b), exact = network.run(b);
      for (std::size_t i = 0; i < found.cells(); ++i) {
        REQUIRE(found.status[i] == CellStatus::done);
        used.insert(found.model[i]);
        const double peak = exact.values[0][i], claim = found.error_estimate[i];
        CAPTURE(b, i, tolerance, claim, static_cast<int>(found.model[i]));
        CHECK(claim <= bound);
        CHECK(std::abs(found.values[0][i] - peak) <= claim * peak);
        for (std::size_t t = 0; t < 26; ++t) {
          CHECK(std::abs(found.values[1][26 * i + t] - exact.values[1][26 * i + t]) <=
                claim * peak);
        }
      }
    }
    // The loose one needs no network, the tight one does.
    CAPTURE(tolerance);
    const auto reduced = static_cast<int>(SharedPlan::models().size());
    CHECK((*used.begin() < reduced) == (bound > 1e-3));
    CHECK((*used.rbegin() >= reduced) == (bound < 1e-2));
  }
}

TEST_CASE("a cell's model and bits do not depend on workers or on the cells before") {
  const test::TempFolder folder;
  const Sweep sweep = parsed_block(R"("tolerance": "0.5 %", )");
  const std::string expected = least_result(sweep, folder / "a.h5", 1);
  CHECK(least_result(sweep, folder / "b.h5", 3) == expected);
  const SweepReader reader(folder / "a.h5");
  std::uint64_t cells = 0;
  for (const auto& [name, count] : reader.models()) cells += count;
  CHECK(cells == sweep.cells());
  CHECK(reader.choice_of_models().find("288 cells share") != std::string::npos);
}

TEST_CASE("where few cells share organ and moduli all run on the network, and it is said") {
  std::string text = shared_block(R"("tolerance": "1 %", )", "1e-6");
  const std::string eta = R"("/material/eta1", "from": "6 kPa s", "to": "96 kPa s")";
  text.replace(text.find(eta), eta.size(), R"("/material/E1", "from": "6 kPa", "to": "96 kPa")");
  const Sweep sweep = parse_sweep(parse_json(text, "sweep"), "sweep", ".");
  const CellBlock block = CellRunner(sweep).run(0);
  for (const std::uint8_t model : block.model) {
    CHECK(sweep.model->models().at(model) == "collocation_0.001");
  }
  CHECK(sweep.model->choice_of_models(sweep.swept()).find("36 cells share") != std::string::npos);
}

TEST_CASE("a claim holds early in a long hold too", "[heavy]") {
  // A ramp of 0.02 relaxation times; the longest of the contact are 31. Largest errors: after 0.9.
  const Json scene = creeping_liver("2 kPa", "60 kPa", "3739375 Pa s", "180.9 s");
  const Sweep sweep = over_depths(scene, "4.05 mm", "5.6 mm", "180 s", "20 %");
  const Sweep expected = over_depths(scene, "4.05 mm", "5.6 mm", "180 s", nullptr);
  const std::uint64_t deepest = sweep.blocks() - 1;
  const CellBlock found = CellRunner(sweep).run(deepest), exact = CellRunner(expected).run(deepest);
  for (std::size_t i = 0; i < found.cells(); ++i) {
    CAPTURE(i, found.error_estimate[i]);
    REQUIRE(found.status[i] == CellStatus::done);
    CHECK(found.model[i] < SharedPlan::models().size());
    double worst = 0.0;
    for (std::size_t t = 200 * i; t < 200 * (i + 1); ++t) {
      worst = std::max(worst, std::abs(found.values[1][t] - exact.values[1][t]));
    }
    const double of_claim = worst / exact.values[0][i] / found.error_estimate[i];
    CHECK(of_claim <= 1.0);
    CHECK(of_claim > 0.3);  // and it is not much larger than it has to be
  }
}

TEST_CASE("claims that would take far longer than the cells are not made", "[heavy]") {
  // Through hours of creep, with E2 = 1000 E1 and E' = 2000 E1, the network takes too many
  // iterations.
  const Json scene = creeping_liver("0.06 kPa", "120 kPa", "412912.5 Pa s", "30 s");
  const Sweep sweep = over_depths(scene, "2.7 mm", "2.82 mm", "30 s", "5 %");
  const std::string choice = sweep.model->choice_of_models(sweep.swept());
  CHECK(choice.find("the cheapest model") != std::string::npos);
  const CellBlock found = CellRunner(sweep).run(0);
  for (std::size_t i = 0; i < found.cells(); ++i) {
    REQUIRE(found.status[i] == CellStatus::done);
    CHECK(sweep.model->models().at(found.model[i]) == "collocation_0.005");
  }
}

TEST_CASE("static curves are the equilibria, at once and relaxed, also where E2 is 1000 E1") {
  constexpr double kDepth_m = 2.8e-3;
  const Json text = creeping_liver("0.06 kPa", "12 kPa", "412912.5 Pa s", "30 s");
  const PlanScene scene = PlanScene(parse_experiment(text, "scene", "."))
                              .with_protocol(ramp_and_hold(kDepth_m, kDepth_m, 0.0));
  const PlanSurrogate surrogate(scene, {}, false);
  const ContactCurves& curves = surrogate.curves();
  const DrivenNetwork& driven = scene.driven();
  StaticPath relaxed(driven.bonds, driven.rest, 0.020, driven.constraints, driven.probes,
                     Drive::displacement, kDepth_m, 1e-8);
  for (const double share : {0.1, 0.5, 1.0}) {
    const double depth = share * kDepth_m;
    CAPTURE(depth);
    CHECK(curves.equilibrium(depth) ==
          Approx(relaxed.move_to(depth, 0.0).response).epsilon(1e-4 / share));
    const Protocol jump(Drive::displacement, {{0.0, depth}, {1.0, depth}}, "jump");
    const std::vector<double> start{0.0};
    const Trajectory instantaneous = scene.with_protocol(jump).quasi_static({}, start, false);
    CHECK(curves.equilibrium(depth) + curves.relaxing(depth) ==
          Approx(instantaneous.response[0]).epsilon(1e-4 / share));
  }
}
