// Sweeps: cells against the tables and the closed forms they are made of, storage, going on after
// an interruption, damaged logs.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "refusal.hpp"
#include "sweep_runs.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/law/element/closed_form.hpp"
#include "tpm/paper/tables.hpp"
#include "tpm/sweep/run_sweep.hpp"
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
  CHECK(file.numbers("/force_time_s") == std::vector<double>{0, 2, 4, 6, 8, 10});
  CHECK(file.numbers("/x").back() == 0.04);
  CHECK(file.attribute("/peak_force", "units") == "N");
  const auto texts = file.texts("/reasons");
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

TEST_CASE("a sweep refuses protocols whose numbers it does not vary, and says so") {
  const auto refusal_with =
      [](const std::string& protocol) {
        return test::refusal_of([&] {
          static_cast<void>(parsed(R"({"model": "organ", "scene": {"organ": {"kind": "star"},
        "protocol": )" + protocol + R"(},
        "axes": [{"parameter": "/material/E1", "values": ["6 kPa", "12 kPa"]}],
        "outputs": ["peak_force"]})"));
        });
      };
  const std::string sine =
      refusal_with(R"({"kind": "sine", "depth": "4 mm", "frequency": "0.5 Hz", "cycles": 2})");
  CHECK(sine.find("/scene/protocol/kind") != std::string::npos);
  CHECK(sine.find("a sweep does not vary a 'sine'") != std::string::npos);
  CHECK(sine.find("ramp_hold, step_hold, creep, knots") != std::string::npos);
  const std::string missing = refusal_with(R"({"kind": "recording", "file": "not_there.csv"})");
  CHECK(missing.find("not_there.csv") != std::string::npos);
  const test::TempFolder folder;
  std::ofstream(folder / "push.csv") << "time s,depth mm,force N\n0,0,0\n1,1,0.1\n2,2,0.2\n";
  const std::string recording =
      refusal_with(R"({"kind": "recording", "file": ")" + (folder / "push.csv") + "\"}");
  CHECK(recording.find("a sweep does not vary a 'recording'") != std::string::npos);
  const std::string unknown = refusal_with(R"({"kind": "cosine", "depth": "4 mm"})");
  CHECK(unknown.find("unknown") != std::string::npos);
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
      {R"("name": "share")", R"("name": "force_time_s")", "the name 'force_time_s' is taken"},
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
