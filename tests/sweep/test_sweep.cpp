// Sweeps: cells against the tables and the closed forms they are made of, storage, going on after
// an interruption, damaged logs.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/base/point_set.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/paper/tables.hpp"
#include "tpm/sweep/best_cells.hpp"
#include "tpm/sweep/run_sweep.hpp"
#include "tpm/sweep/show/sweep_convergence_report.hpp"
#include "tpm/sweep/show/sweep_report.hpp"
#include "tpm/sweep/sweep_result.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::law;
using namespace tpm::files;
using namespace tpm::show;
using namespace tpm::fit;
using namespace tpm::sweep;
using namespace tpm::paper;
using Catch::Matchers::WithinRel;

namespace {

Sweep parsed(std::string_view text) {
  return parse_sweep(parse_json(text, "sweep"), "sweep", ".");
}

/// The whole sweep as blocks of one runner.
std::vector<CellBlock> all_blocks(const Sweep& sweep) {
  CellRunner runner(sweep);
  std::vector<CellBlock> blocks;
  for (std::uint64_t b = 0; b < sweep.blocks(); ++b) blocks.push_back(runner.run(b));
  return blocks;
}

CellBlock only_block(const Sweep& sweep) {
  REQUIRE(sweep.blocks() == 1);
  return all_blocks(sweep).front();
}

/// Runs to the end and writes; the bytes of the HDF5 file.
std::string result_of(const Sweep& sweep, const std::string& file,
                      const SweepControls& controls = {}) {
  BlockLog log(log_path(file), sweep, {});
  const SweepRun run = run_sweep(sweep, log, controls);
  REQUIRE_FALSE(run.interrupted);
  static_cast<void>(write_sweep(sweep, {&log}, file, controls.workers));
  return read_file(file);
}

/// Three axes, conditions, failures, a curve and a formula, in blocks that end within rows.
const char* const kMixed = R"({"model": "single_contact", "block": 7,
  "material": {"eta1": "240 kPa s"},
  "indentation": {"kind": "ramp_hold", "depth": "8 mm", "hold": "10 s"},
  "axes": [{"parameter": "rate", "values": ["1 mm/s", "-1 mm/s", "4 mm/s"]},
           {"parameter": "E1", "from": "6 kPa", "to": "24 kPa", "count": 4, "scale": "log"},
           {"parameter": "spacing", "name": "x", "from": "10 mm", "to": "40 mm", "count": 5}],
  "skip": [{"when": "x < 0.011", "reason": "too close"}],
  "outputs": ["peak_force", {"force_over": {"from": "0 s", "to": "10 s", "count": 6}, "name": "force"},
              "end_force", {"formula": "end_force / peak_force", "name": "share"}]})";

}  // namespace

TEST_CASE("configs/sweep_x_depth.json holds the numbers of tpm paper tables to the last bit") {
  const Sweep sweep =
      read_sweep(std::filesystem::path(TPM_TEST_SOURCE_DIR) / "configs/sweep_x_depth.json");
  const CellBlock block = only_block(sweep);
  const TablesResult tables =
      make_tables({}, read_printed_tables(read_json(paper_claims_path()), "paper"));
  REQUIRE(block.cells() == tables.rows.size());
  for (std::size_t i = 0; i < block.cells(); ++i) {
    const TableRow& row = tables.rows[i];
    const auto places = sweep.places(i);
    CHECK(sweep.parameters[0].values.at(places[0]) == row.depth_m);
    CHECK(sweep.parameters[1].values.at(places[1]) == row.spacing_m);
    CHECK(block.values[0][i] == row.lambda1.value);
    CHECK(block.values[1][i] == row.peak_force.value);
    CHECK(block.values[2][i] == row.end_force.value);
    CHECK(row.peak_force.printed);
  }
}

TEST_CASE("a ramp and a hold in a sweep are those of tpm paper tables --consistent") {
  const Sweep sweep = parsed(R"({"model": "single_contact", "material": {"eta1": "240 kPa s"},
    "indentation": {"kind": "ramp_hold", "rate": "4 mm/s", "hold": "30 s"},
    "axes": [{"parameter": "depth", "values": ["2 mm", "4 mm", "6 mm", "8 mm"]},
             {"parameter": "spacing", "values": ["20 mm", "25 mm", "30 mm", "35 mm"]}],
    "outputs": ["peak_force", "end_force"]})");
  const CellBlock block = only_block(sweep);
  TableRequest request;
  request.mode = TableMode::consistent;
  request.parameters.eta1_Pa_s = 240e3;
  const TablesResult tables = make_tables(request, {});
  REQUIRE(block.cells() == tables.rows.size());
  for (std::size_t i = 0; i < block.cells(); ++i) {
    CHECK(block.values[0][i] == tables.rows[i].peak_force.value);
    CHECK(block.values[1][i] == tables.rows[i].end_force.value);
  }
}

TEST_CASE("creep in a sweep obeys the balance at once and in the end, and the model in between") {
  const Sweep sweep = parsed(R"({"model": "single_contact", "material": {"eta1": "240 kPa s"},
    "creep": {}, "axes": [{"parameter": "load", "values": ["0.196 N", "0.98 N"]}],
    "outputs": ["instantaneous_creep_depth", "creep_depth", {"creep_depth_at": "7 s", "name": "at7"},
                {"creep_depth_over": {"values": ["0 s", "7 s"]}, "name": "depth_over"}]})");
  const CellBlock block = only_block(sweep);
  TpmParameters p;
  p.eta1_Pa_s = 240e3;
  const auto v = to_vector(p);
  for (const auto& [i, load] : {std::pair{std::size_t{0}, 0.196}, {std::size_t{1}, 0.98}}) {
    CHECK_THAT(block.values[0][i], WithinRel(equilibrium_depth_m(p, p.E2_Pa, load), 1e-12));
    CHECK_THAT(block.values[1][i],
               WithinRel(equilibrium_depth_m(p, p.equilibrium_modulus_Pa(), load), 1e-12));
    const std::array times{7.0};
    const double at7 =
        make_model("cvodes", {})->respond(creep(load, 10.0), times, v, Want::values).value[0];
    CHECK_THAT(block.values[2][i], WithinRel(at7, 1e-7));
    CHECK(block.values[3][2 * i] == block.values[0][i]);
    CHECK(block.values[3][2 * i + 1] == block.values[2][i]);
  }
}

TEST_CASE("ranges reach both ends exactly and lie evenly on their scale") {
  const auto linear = ParameterValues::range(0.1, 0.7, 7, AxisScale::linear);
  const auto log = ParameterValues::range(1e-3, 1e3, 7, AxisScale::logarithmic);
  CHECK((linear.at(0) == 0.1 && linear.at(6) == 0.7));
  CHECK((log.at(0) == 1e-3 && log.at(6) == 1e3));
  for (std::uint64_t i = 0; i < 7; ++i) {
    CHECK_THAT(linear.at(i), WithinRel(0.1 * static_cast<double>(i + 1), 1e-14));
    CHECK_THAT(log.at(i), WithinRel(std::pow(10.0, static_cast<double>(i) - 3.0), 1e-13));
  }
  const auto sampled =
      ParameterValues::samples(2.0, 8.0, AxisScale::logarithmic, [](std::uint64_t) { return 0.5; });
  CHECK_THAT(sampled.at(3), WithinRel(4.0, 1e-14));
}

TEST_CASE("cells that are skipped or fail keep their place and say why") {
  const Sweep sweep = parsed(kMixed);
  REQUIRE(sweep.cells() == 60);
  const auto blocks = all_blocks(sweep);
  REQUIRE(blocks.size() == 9);
  CHECK(blocks.back().cells() == 4);
  for (std::uint64_t cell = 0; cell < sweep.cells(); ++cell) {
    const auto places = sweep.places(cell);
    const CellBlock& block = blocks[cell / 7];
    const std::size_t i = cell % 7;
    CAPTURE(cell);
    const std::string reason = block.reason[i] == 0 ? "" : block.reasons[block.reason[i] - 1U];
    if (places[2] == 0) {
      CHECK(block.status[i] == CellStatus::skipped);
      CHECK(reason == "too close");
    } else if (places[0] == 1) {
      CHECK(block.status[i] == CellStatus::failed);
      CHECK(reason.find("rate") != std::string::npos);
    } else {
      CHECK(block.status[i] == CellStatus::done);
      CHECK(block.values[3][i] == block.values[2][i] / block.values[0][i]);
      CHECK(block.counts[0][i] == 10);
      continue;
    }
    for (const std::size_t v : {0U, 2U, 3U}) CHECK(std::isnan(block.values[v][i]));
    for (std::size_t t = 0; t < 6; ++t) CHECK(std::isnan(block.values[1][6 * i + t]));
  }
}

TEST_CASE("the file of results holds each cell at its place, whatever the blocks") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(kMixed);
  static_cast<void>(result_of(sweep, folder / "a.h5"));
  const Hdf5Reader file(folder / "a.h5");
  CHECK(file.extents("/force") == std::vector<std::uint64_t>{3, 4, 5, 6});
  CHECK(file.numbers("/force_time") == std::vector<double>{0, 2, 4, 6, 8, 10});
  CHECK(file.numbers("/x").back() == 0.04);
  CHECK(file.attribute("/peak_force", "units") == "N");
  const auto texts = file.texts("/reason_text");
  REQUIRE(texts.size() == 3);
  CHECK((texts[0].empty() && texts[1] == "too close"));
  const auto blocks = all_blocks(sweep);
  for (std::uint64_t cell = 0; cell < sweep.cells(); ++cell) {
    auto places = sweep.places(cell);
    const CellBlock& block = blocks[cell / 7];
    const std::size_t i = cell % 7;
    CHECK(file.part("/status", places, {1, 1, 1})[0] == static_cast<double>(block.status[i]));
    const double reason = file.part("/reason", places, {1, 1, 1})[0];
    CHECK(texts[static_cast<std::size_t>(reason)] ==
          (block.reason[i] == 0 ? "" : block.reasons[block.reason[i] - 1U]));
    const double peak = file.part("/peak_force", places, {1, 1, 1})[0];
    CHECK((peak == block.values[0][i] || (std::isnan(peak) && std::isnan(block.values[0][i]))));
    places.push_back(0);
    const auto curve = file.part("/force", places, {1, 1, 1, 6});
    for (std::size_t t = 0; t < 6; ++t) {
      const double expected = block.values[1][6 * i + t];
      CHECK((curve[t] == expected || (std::isnan(curve[t]) && std::isnan(expected))));
    }
  }
  CHECK_FALSE(test::refusal_of([&] { static_cast<void>(file.part("/x", {4}, {2})); }).empty());
}

TEST_CASE("any number of workers, any interruptions: the same bytes") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(kMixed);
  SweepControls controls;
  controls.workers = 1;
  const std::string expected = result_of(sweep, folder / "a.h5", controls);
  controls.workers = 3;
  CHECK(result_of(sweep, folder / "b.h5", controls) == expected);
  // Stopped in each block once after its first cells, then to the end: what is not whole is lost.
  const std::string file = folder / "c.h5";
  SweepControls stopping;
  stopping.workers = 1;
  for (std::uint64_t b = 1; b < sweep.blocks(); ++b) {
    std::uint64_t asked = 0;
    stopping.interrupted = [&] { return ++asked > sweep.block_cells + b % 3; };
    BlockLog log(log_path(file), sweep, {});
    const SweepRun run = run_sweep(sweep, log, stopping);
    CHECK(run.interrupted);
    CHECK(asked == sweep.block_cells + b % 3 + 1);
    CHECK(run.cells == sweep.block_cells);
    CHECK(run.resumed_blocks == b - 1);
  }
  CHECK(result_of(sweep, file) == expected);
}

TEST_CASE("a log that is cut, damaged or another sweep's") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(kMixed);
  const std::string file = folder / "a.h5";
  const std::string expected = result_of(sweep, file);
  const std::string log = read_file(log_path(file));
  const auto left_of = [&](const std::string& bytes) {
    std::ofstream(log_path(file), std::ios::binary) << bytes;
    std::string noted;
    const std::uint64_t found =
        BlockLog(log_path(file), sweep, [&](const std::string& text) { noted += text; }).size();
    CHECK(result_of(sweep, file) == expected);
    return std::pair{found, noted};
  };
  CHECK(left_of(log) == std::pair{std::uint64_t{9}, std::string()});
  CHECK(left_of(log.substr(0, log.size() - 1)).first == 8);
  CHECK(left_of(log.substr(0, log.size() / 2)).first == 4);
  CHECK(left_of(log.substr(0, 30)).first == 0);
  // Each byte that is changed costs its own block at most.
  for (std::size_t at = 80; at < log.size(); at += 397) {
    std::string damaged = log;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x20);
    const auto [blocks, noted] = left_of(damaged);
    CAPTURE(at);
    CHECK(blocks == 8);
    // In the last block it looks as if the run had been killed.
    CHECK((noted.empty() == (at >= log.rfind("TPMBLOCK"))));
  }
  std::string other = log;
  other[20] = other[20] == 'a' ? 'b' : 'a';
  std::ofstream(log_path(file), std::ios::binary) << other;
  CHECK(test::refusal_of([&] {
          const BlockLog again(log_path(file), sweep, {});
        }).find("another sweep") != std::string::npos);
  std::ofstream(log_path(file), std::ios::binary) << "what somebody else has written";
  CHECK(test::refusal_of([&] { const BlockLog again(log_path(file), sweep, {}); }).find("no log") !=
        std::string::npos);
  CHECK(read_file(log_path(file)) == "what somebody else has written");
}

TEST_CASE("shards put together are the whole sweep, to the byte") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(kMixed);
  const std::string expected = result_of(sweep, folder / "whole.h5");
  for (const std::uint64_t count : {std::uint64_t{1}, std::uint64_t{3}, std::uint64_t{7}}) {
    std::vector<BlockLog> logs;
    std::uint64_t blocks = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::string file = folder / fmt::format("{}-of-{}", i, count);
      SweepControls controls;
      controls.shard = {i, count};
      BlockLog log(file, sweep, {});
      blocks += run_sweep(sweep, log, controls).blocks;
      logs.push_back(BlockLog::to_read(file, sweep, {}));
      CHECK(logs.back().size() == controls.shard.size(sweep.blocks()));
    }
    CHECK(blocks == sweep.blocks());
    std::vector<const BlockLog*> all;
    all.reserve(logs.size());
    for (const BlockLog& log : logs) all.push_back(&log);
    static_cast<void>(write_sweep(sweep, all, folder / "merged.h5"));
    CHECK(read_file(folder / "merged.h5") == expected);
    all.pop_back();
    CHECK(test::refusal_of([&] { write_sweep(sweep, all, folder / "part.h5"); }).find("missing") !=
          std::string::npos);
    CHECK_FALSE(std::filesystem::exists(folder / "part.h5"));
  }
}

TEST_CASE("a material that no tissue has is refused before the first cell") {
  std::string text = R"({"model": "single_contact", "material": {"E1": "-12 kPa"},
    "indentation": {"kind": "step_hold"}, "outputs": ["peak_force"],
    "axes": [{"parameter": "depth", "values": ["2 mm"]}]})";
  const std::string refusal = test::refusal_of([&] { static_cast<void>(parsed(text)); });
  CHECK(refusal.find("material") != std::string::npos);
  CHECK(refusal.find("E1 = -12000 Pa") != std::string::npos);
}

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
  CHECK_FALSE(to_text(to_json(sensitivity_figures({sum, peak}, "title"))).empty());
  const Sweep plain = parsed(kMixed);
  static_cast<void>(result_of(plain, folder / "b.h5"));
  CHECK(test::refusal_of([&] {
          static_cast<void>(sensitivity_of(SweepReader(folder / "b.h5"), "share", {}));
        }).find("no axis of samples") != std::string::npos);
}

TEST_CASE("a sweep over a star as a network is the sweep over it in closed form") {
  const Sweep star = parsed(R"({"model": "organ", "block": 5, "scene": {
      "organ": {"kind": "star", "spacing": "30 mm"},
      "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "240 kPa s"},
      "protocol": {"kind": "ramp_hold", "depth": "4 mm", "rate": "4 mm/s", "hold": "30 s"},
      "tolerance": 1e-7},
    "axes": [{"parameter": "/organ/spacing", "name": "x", "values": ["20 mm", "30 mm"]},
             {"parameter": "/material/E1", "values": ["6 kPa", "12 kPa"]},
             {"parameter": "/protocol/depth", "values": ["2 mm", "8 mm"]}],
    "outputs": ["peak_force", "end_force", {"force_at": "7 s", "name": "at7"}]})");
  const Sweep closed = parsed(R"({"model": "single_contact", "block": 5,
    "material": {"eta1": "240 kPa s"},
    "indentation": {"kind": "ramp_hold", "rate": "4 mm/s", "hold": "30 s"},
    "axes": [{"parameter": "spacing", "values": ["20 mm", "30 mm"]},
             {"parameter": "E1", "values": ["6 kPa", "12 kPa"]},
             {"parameter": "depth", "values": ["2 mm", "8 mm"]}],
    "outputs": ["peak_force", "end_force", {"force_at": "7 s", "name": "at7"}]})");
  const auto found = all_blocks(star);
  const auto expected = all_blocks(closed);
  for (std::size_t b = 0; b < found.size(); ++b) {
    for (std::size_t i = 0; i < found[b].cells(); ++i) {
      REQUIRE(found[b].status[i] == CellStatus::done);
      CHECK(found[b].error_estimate[i] <= 1e-7);
      CHECK(found[b].counts[0][i] > 0);
      for (std::size_t v = 0; v < 3; ++v) {
        CHECK_THAT(found[b].values[v][i], WithinRel(expected[b].values[v][i], 1e-6));
      }
    }
  }
  // A block by itself, without those before it: the same bits.
  CHECK(CellRunner(star).run(1).values == found[1].values);
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

TEST_CASE("a damaged result is refused before HDF5 reads it, and made anew") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(kMixed);
  const std::string file = folder / "a.h5", whole = result_of(sweep, file);
  CHECK(fingerprint_of(file) == sweep.fingerprint);
  for (std::size_t at = 64; at < whole.size() - 24; at += 1501) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x40);
    std::ofstream(file, std::ios::binary) << damaged;
    CAPTURE(at);
    CHECK(test::refusal_of([&] { static_cast<void>(SweepReader(file)); }).find("damaged") !=
          std::string::npos);
    CHECK(fingerprint_of(file).empty());
  }
  CHECK(result_of(sweep, file) == whole);
}

TEST_CASE("a log is written by one process at a time") {
  const test::TempFolder folder;
  const Sweep sweep = parsed(kMixed);
  const BlockLog holder(folder / "a.blocks", sweep, {});
  CHECK(test::refusal_of([&] {
          const BlockLog second(folder / "a.blocks", sweep, {});
        }).find("another tpm sweep") != std::string::npos);
}

TEST_CASE("parameters that go on together are one axis") {
  const Sweep sweep = parsed(R"({"model": "single_contact",
    "indentation": {"kind": "step_hold", "depth": "4 mm"},
    "axes": [{"name": "tissue", "together": {"E1": {"values": ["6 kPa", "12 kPa"]},
                                             "E2": {"values": ["8 kPa", "9 kPa"]}}}],
    "outputs": ["peak_force"]})");
  REQUIRE(sweep.cells() == 2);
  const CellBlock block = only_block(sweep);
  TpmParameters p;
  p.E1_Pa = 12e3;
  p.E2_Pa = 9e3;
  CHECK(block.values[0][1] ==
        step_relaxation_force_N(p, lambda1_Pa(p.Eprime_Pa, 0.004, p.spacing_m), 0.004, 0.0));
}

TEST_CASE("mistakes in a sweep are told in one line before anything is computed") {
  const std::vector<std::tuple<std::string, std::string, std::string>> mistakes{
      {R"("parameter": "rate")", R"("parameter": "speed")", "unknown parameter 'speed'"},
      {R"("1 mm/s")", R"("1 mm")", "/axes/0/values/0"},
      {R"("parameter": "E1")", R"("parameter": "load")", "experiment that is not there"},
      {R"("parameter": "E1")", R"("parameter": "E1", "name": "x")", "the name 'x' is taken"},
      {R"("count": 4,)", "", "no 'count'"},
      {R"("from": "6 kPa")", R"("from": "0 kPa")", "not above 0"},
      {R"("count": 4,)", R"("count": 4, "values": ["1 kPa"],)", "values and a range"},
      {R"(x < 0.011)", R"(y < 0.011)", "unknown symbol 'y'"},
      {R"(x < 0.011)", R"(x < )", "expression"},
      {R"("end_force",)", R"("end_farce",)", "unknown word 'end_farce'"},
      {R"("end_force",)", R"("creep_depth",)", "without creep"},
      {R"("name": "share")", R"("name": "force")", "the name 'force' is taken"},
      {R"("name": "share")", R"("name": "sweep")", "the name 'sweep' is taken"},
      {R"("name": "share")", R"("name": "force_time")", "the name 'force_time' is taken"},
      {R"("name": "share")", R"("name": "count_creep_depths")", "is taken"},
      {R"("parameter": "E1")", R"("parameter": "E1", "name": "status")", "'status' is taken"},
      {R"("hold": "10 s")", R"("kind2": "10 s")", "kind2"},
      {R"(, "hold": "10 s")", "", "no 'hold'"},
      {R"("to": "10 s")", R"("to": "-10 s")", "0 s or more"},
      {R"("count": 5)", R"("count": 900000000000)", "cells"},
  };
  for (const auto& [from, to, expected] : mistakes) {
    std::string text = kMixed;
    const auto at = text.find(from);
    REQUIRE(at != std::string::npos);
    text.replace(at, from.size(), to);
    const std::string said = test::refusal_of([&] { static_cast<void>(parsed(text.c_str())); });
    CAPTURE(from, to, said);
    CHECK(said.find(expected) != std::string::npos);
    CHECK(said.find('\n') == std::string::npos);
  }
}
