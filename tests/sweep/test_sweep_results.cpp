// Results of sweeps: read back by axes, Pareto fronts, samples and sensitivities, convergence along
// an axis, the best cell as the start of a fit.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "refusal.hpp"
#include "sweep_runs.hpp"
#include "temp_folder.hpp"
#include "tpm/base/point_set.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/sweep/best_cells.hpp"
#include "tpm/sweep/run_sweep.hpp"
#include "tpm/sweep/show/sweep_convergence_report.hpp"
#include "tpm/sweep/show/sweep_report.hpp"
#include "tpm/sweep/sweep_reader.hpp"
#include "tpm/sweep/sweep_result.hpp"

using namespace tpm;
using namespace tpm::sweep;
using namespace tpm::paper;
using Catch::Matchers::WithinRel;
using test::all_blocks;
using test::kMixed;
using test::only_block;
using test::parsed;
using test::result_of;

TEST_CASE("a file of results is read back by axes, either way round, and drawn") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(kMixed);
  static_cast<void>(result_of(sweep, folder / "a.h5"));
  const SweepReader reader(folder / "a.h5");
  REQUIRE(reader.axes().size() == 3);
  CHECK(reader.tally().skipped == 12);
  CHECK(reader.tally().failed == 16);
  CHECK(reader.parameter_unit("E1") == "Pa");
  const FixedPlaces fixed{{"rate", 2}};
  const auto upright = reader.slice("end_force", "E1", "x", fixed);
  const auto turned = reader.slice("end_force", "x", "E1", fixed);
  const auto whole = all_blocks(sweep);
  for (std::uint64_t e = 0; e < 4; ++e) {
    for (std::uint64_t x = 1; x < 5; ++x) {
      const std::uint64_t cell = (8 + e) * 5 + x;  // the third of 4 by 5 places
      CHECK(upright[e * 5 + x] == whole[cell / 7].values[2][cell % 7]);
      CHECK(turned[x * 4 + e] == upright[e * 5 + x]);
      CHECK(reader.curve("force", {{"rate", 2}, {"E1", e}, {"x", x}}).back() ==
            whole[cell / 7].values[1][6 * (cell % 7) + 5]);
    }
  }
  SweepFigures wished;
  wished.fixed = fixed;
  wished.pareto = {"share", "peak_force"};
  const auto figures = sweep_figures(reader, wished);
  REQUIRE(figures.size() == 5);
  const Series& map = figures[0].panels[0].series[0];
  CHECK(map.kind == Series::Kind::heat);
  CHECK(map.z.size() == map.x.size() * map.y.size());
  // Which slice is drawn stands in the picture; a place on an axis that is drawn whole is refused.
  CHECK(figures[0].note.find("At rate = ") == 0);
  CHECK(to_json(figures).at("figures")[0].at("note") == figures[0].note);
  SweepFigures refused = wished;
  refused.x = "rate";
  CHECK(test::refusal_of([&] {
          static_cast<void>(sweep_figures(reader, refused));
        }).find("--at rate: the figure of") != std::string::npos);
  // Axes that are held are not drawn over unless that is asked for.
  SweepFigures along;
  along.fixed = {{"x", 1}};
  along.variables = {"end_force"};
  CHECK(sweep_figures(reader, along)[0].panels[0].x.quantity == "E1");
  CHECK_FALSE(to_text(to_json(figures)).empty());  // it can be drawn
  const Axis& force = figures[4].panels[0].x;      // a name in words, its unit of the size
  CHECK(force.quantity == "peak force");
  double largest = 0.0;
  for (const double v : figures[4].panels[0].series[0].x) largest = std::max(largest, std::abs(v));
  CHECK(largest > 0.1);
  CHECK(sweep_text(reader).find("12 skipped, 16 failed") != std::string::npos);
}

TEST_CASE("a Pareto front is what no other pair betters in both") {
  Random random(3);
  std::vector<std::pair<double, double>> pairs;
  pairs.reserve(300);
  for (int i = 0; i < 300; ++i) {
    pairs.emplace_back(std::floor(20.0 * random.uniform()), std::floor(20.0 * random.uniform()));
  }
  const auto front = pareto_front(pairs);
  const auto bettered = [&](const auto& p) {
    return std::any_of(pairs.begin(), pairs.end(), [&](const auto& q) {
      return q.first <= p.first && q.second <= p.second && q != p;
    });
  };
  for (const auto& p : pairs) {
    CHECK((std::find(front.begin(), front.end(), p) != front.end()) == !bettered(p));
  }
}

TEST_CASE("samples are the point set's coordinates between the ends") {
  const char* const text = R"({"model": "single_contact",
    "indentation": {"kind": "step_hold", "depth": "4 mm"},
    "axes": [{"parameter": "spacing", "values": ["20 mm", "30 mm"]},
             {"samples": "KIND", "count": 16, "seed": 5, MORE "parameters": {
               "E1": {"from": "6 kPa", "to": "24 kPa", "scale": "log"},
               "E2": {"from": "10 kPa", "to": "20 kPa"}}}],
    "outputs": ["peak_force"]})";
  const auto with = [&](const std::string& kind, const std::string& more) {
    std::string filled = text;
    filled.replace(filled.find("KIND"), 4, kind);
    filled.replace(filled.find("MORE"), 4, more);
    return parsed(filled.c_str());
  };
  const std::vector<std::pair<std::string, std::unique_ptr<CubePoints>>> sets = [] {
    std::vector<std::pair<std::string, std::unique_ptr<CubePoints>>> made;
    made.emplace_back("random", random_points(5));
    made.emplace_back("latin_hypercube", latin_hypercube(16, 5));
    made.emplace_back("sobol", sobol_points(2, 5));
    made.emplace_back("plain_sobol", plain_sobol_points(2));
    return made;
  }();
  for (const auto& [kind, set] : sets) {
    CAPTURE(kind);
    const Sweep sweep = with(kind, "");
    REQUIRE(sweep.cells() == 32);
    const CellBlock block = only_block(sweep);
    for (std::uint64_t i = 0; i < 16; ++i) {
      const double E1 = 6e3 * std::pow(4.0, set->coordinate(i, 0));
      const double E2 = 10e3 + 10e3 * set->coordinate(i, 1);
      CHECK_THAT(sweep.parameters[1].values.at(i), WithinRel(E1, 1e-14));
      CHECK(sweep.parameters[2].values.at(i) == E2);
      CHECK_THAT(block.values[0][16 + i],
                 WithinRel((E2 + lambda1_Pa(12e3, 0.004, 0.03)) * 0.004 * 12.56e-3, 1e-13));
    }
  }
  // 2 places of the other axis, 3 replicates of 16 points in 4 matrices
  CHECK(with("sensitivity", R"("replicates": 3,)").cells() == 384);
  CHECK(test::refusal_of([&] {
          static_cast<void>(with("sobol", R"("replicates": 3,)"));
        }).find("replicates") != std::string::npos);
  CHECK(test::refusal_of([&] { static_cast<void>(with("sobel", "")); }).find("one of random") !=
        std::string::npos);
}

TEST_CASE("sensitivity of a sum: each term's share of the variance") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(R"({"model": "single_contact",
    "indentation": {"kind": "step_hold", "depth": "4 mm"},
    "axes": [{"samples": "sensitivity", "count": 64, "replicates": 16, "seed": 2, "parameters": {
               "E1": {"from": "6 kPa", "to": "16 kPa"}, "E2": {"from": "10 kPa", "to": "20 kPa"}}},
             {"parameter": "depth", "values": ["4 mm", "8 mm"]}],
    "outputs": ["peak_force", {"formula": "E1 + 2 * E2 + 1e6 * depth", "name": "sum"}]})");
  static_cast<void>(result_of(sweep, folder / "a.h5"));
  const SweepReader reader(folder / "a.h5");
  const SweepSensitivity sum = sensitivity_of(reader, "sum", {{"depth", 1}});
  REQUIRE(sum.parameters == std::vector<std::string>{"E1", "E2"});
  CHECK_THAT(sum.indices.mean, WithinRel(11e3 + 30e3 + 8e3, 1e-4));
  for (const auto& [input, share] : {std::pair{0U, 0.2}, {1U, 0.8}}) {
    for (const IndexEstimate& index :
         {sum.indices.inputs[input].first_order, sum.indices.inputs[input].total}) {
      CHECK(std::abs(index.value - share) < 2.0 * (index.high - index.low));
      CHECK(index.high - index.low < 0.03);
    }
  }
  REQUIRE(sum.fixed.size() == 1);
  CHECK_THAT(sum.fixed[0].value, WithinRel(8e-3, 1e-12));
  CHECK(sensitivity_text({sum}).find(", at depth = 8 mm") != std::string::npos);
  // A step's first force does not know E1.
  const SweepSensitivity peak = sensitivity_of(reader, "peak_force", {});
  CHECK(peak.indices.inputs[0].total.value == 0.0);
  CHECK(sensitivity_text({sum, peak}).find("E2") != std::string::npos);
  const ShortAnswer answer = short_answer(std::vector{sum, peak}, "title");
  REQUIRE(answer.rows.size() == 2);  // of each number the parameters, the decisive one first
  CHECK_THAT(answer.rows[0],
             Catch::StartsWith("sum at depth = 8 mm") && Catch::Contains(" E2 0.8"));
  CHECK_THAT(answer.rows[1], Catch::StartsWith("peak_force") && Catch::Contains(" N ") &&
                                 Catch::Contains(" E2 1.00"));
  const auto figures = sensitivity_figures({sum, peak}, "title");
  CHECK_FALSE(to_text(to_json(figures)).empty());
  CHECK(figures[1].title == "peak force");
  const Sweep plain = parsed(kMixed);
  static_cast<void>(result_of(plain, folder / "b.h5"));
  CHECK(test::refusal_of([&] {
          static_cast<void>(sensitivity_of(SweepReader(folder / "b.h5"), "share", {}));
        }).find("no axis of samples") != std::string::npos);
}

TEST_CASE("convergence along an axis: order and limit of a known error, and its absence") {
  const test::TempFolder folder;
  // Formulas of the size stand in for an answer: 3 + 40 x^2; one that swings; one that grows.
  const Sweep sweep = parsed(R"({"model": "single_contact",
    "indentation": {"kind": "step_hold", "depth": "4 mm"},
    "axes": [{"parameter": "E2", "values": ["8 kPa", "12 kPa"]},
             {"parameter": "spacing", "name": "x", "values": ["10 mm", "40 mm", "20 mm", "80 mm"]}],
    "outputs": ["peak_force", {"formula": "3 + E2 / 200 * x^2", "name": "second"},
                {"formula": "x < 0.015 ? 1 : x < 0.03 ? 2 : x < 0.05 ? 0 : 5", "name": "swings"},
                {"formula": "1 / x", "name": "grows"}]})");
  static_cast<void>(result_of(sweep, folder / "a.h5"));
  const SweepReader reader(folder / "a.h5");
  const SweepConvergence c = convergence_of(reader, "second", "x", "", {{"E2", 0}});
  CHECK(c.size == std::vector<double>{0.08, 0.04, 0.02, 0.01});
  REQUIRE(c.threes.size() == 2);
  for (const GridConvergence& g : c.threes) {
    CHECK_THAT(g.order, WithinRel(2.0, 1e-6));
    CHECK_THAT(g.extrapolated, WithinRel(3.0, 1e-9));
  }
  CHECK_THAT(c.threes.back().index, WithinRel(1.25 * 40.0 * 1e-4, 1e-6));
  // As a function of the number of spheres in a volume, which falls with the cube of x.
  const SweepConvergence by_count = convergence_of(reader, "second", "x", "(1/x^3)^(-1/3)", {});
  CHECK_THAT(by_count.threes.back().order, WithinRel(2.0, 1e-6));
  const SweepConvergence swings = convergence_of(reader, "swings", {}, "", {});
  const SweepConvergence grows = convergence_of(reader, "grows", {}, "", {});
  CHECK_FALSE((swings.monotone() || grows.monotone()));
  const std::string text = convergence_text({c, swings, grows});
  CHECK(text.find("no monotone convergence") != std::string::npos);
  CHECK(text.find("no convergence: the last change") != std::string::npos);
  const Json json = convergence_json({c, grows});
  CHECK(json.at("convergence")[1].at("threes")[0].at("order").is_null());
  CHECK_FALSE(to_text(to_json(convergence_figures({c, swings}, "title"))).empty());
  CHECK(test::refusal_of([&] {
          static_cast<void>(convergence_of(reader, "second", "E2", "", {}));
        }).find("2 places") != std::string::npos);
  CHECK(text.find("over axis x at E2 = ") != std::string::npos);
  CHECK(test::refusal_of([&] {
          static_cast<void>(convergence_of(reader, "second", "x", "", {{"x", 0}}));
        }).find("looked along") != std::string::npos);
  CHECK(test::refusal_of([&] {
          static_cast<void>(convergence_of(reader, "second", "x", "1/n", {}));
        }).find("unknown symbol 'n'; expected x") != std::string::npos);
}

TEST_CASE("steps of the integrator: the order of two Radau nodes is three") {
  const test::TempFolder folder;
  const std::string scene = R"({"model": "organ", "scene": {
      "organ": {"kind": "block", "cells": [2, 2, 2], "spacing": "20 mm", "lattice": "cubic"},
      "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "24 kPa s"},
      "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "1 mm"], "normal": [0, 0, -1]}],
      "contacts": [{"kind": "sphere", "number": 5}],
      "protocol": {"kind": "ramp_hold", "depth": "6 mm", "rate": "6 mm/s", "hold": "1 s"},
      "tolerance": 1e-12}, "outputs": ["end_force"], )";
  const Sweep sweep = parsed(scene + R"("integrator": {"step": "1 s", "stages": 2},
    "axes": [{"parameter": "/integrator/step", "values": ["0.5 s", "0.25 s", "0.125 s", "0.0625 s"]}]})");
  static_cast<void>(result_of(sweep, folder / "a.h5"));
  const SweepConvergence c = convergence_of(SweepReader(folder / "a.h5"), "end_force", {}, "", {});
  CAPTURE(c.value, c.threes.back().order);
  CHECK(std::abs(c.threes.back().order - 3.0) < 0.2);
  // Without the block the steps follow the tolerance.
  const double expected =
      only_block(parsed(scene + R"("axes": [{"parameter": "/tolerance", "values": [1e-12]}]})"))
          .values[0][0];
  CHECK(std::abs(c.threes.back().extrapolated - expected) <=
        c.threes.back().index + 1e-10 * expected);
}

TEST_CASE("the best cell of a sweep is where a fit goes on") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(R"({"model": "single_contact", "material": {"eta1": "240 kPa s"},
    "indentation": {"kind": "ramp_hold", "rate": "4 mm/s", "hold": "30 s"},
    "axes": [{"parameter": "spacing", "values": ["20 mm", "30 mm"]},
             {"parameter": "depth", "values": ["4 mm", "8 mm"]},
             {"name": "modulus", "together": {"E1": {"values": ["6 kPa", "12 kPa", "24 kPa"]},
                                              "E2": {"values": ["6 kPa", "12 kPa", "24 kPa"]}}}],
    "skip": [{"when": "spacing > 0.025 && E1 > 20000 && depth > 0.006"}],
    "outputs": ["peak_force", {"formula": "(E1 / 12000 - 1)^2 + (spacing / 0.03 - 1)^2 + depth", "name": "misfit"}]})");
  static_cast<void>(result_of(sweep, folder / "a.h5"));
  const SweepReader reader(folder / "a.h5");
  const auto best = best_cells(reader, "misfit", 2, "depth");
  REQUIRE(best.size() == 2);
  CHECK_THAT(best[0].value, WithinRel(0.012, 1e-12));
  CHECK(best[0].places == std::vector<std::uint64_t>{1, 0, 1});
  CHECK(best[0].parameters.size() == 3);
  // What is skipped somewhere along the sum is no cell: 2 x 3 cells less one.
  CHECK(best_cells(reader, "misfit", 100, "depth").size() == 5);
  const Json fit =
      read_json(std::filesystem::path(TPM_TEST_SOURCE_DIR) / "configs/organ_relaxation.json");
  const Json started = fit_from_cell(fit, best[0], "fit");
  // That configuration sets E1, E2 and E' at once.
  CHECK(started.at("parameters").at("E").at("start") == "12000 Pa");
  CHECK(started.at("parameters").at("spacing").at("start") == "0.03 m");
  CHECK(started.at("parameters").at("eta1") == fit.at("parameters").at("eta1"));
  CHECK(started.at("starts").at("count") == 1);
  Json narrow = fit;
  narrow["parameters"]["E"]["upper"] = "10 kPa";
  CHECK(test::refusal_of([&] {
          static_cast<void>(fit_from_cell(narrow, best[0], "fit"));
        }).find("/parameters/E/upper") != std::string::npos);
}
