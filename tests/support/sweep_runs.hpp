#pragma once
// Sweeps that are read from text and run whole, and one that holds a bit of everything.
#include <catch2/catch.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/files/file.hpp"
#include "tpm/sweep/run_sweep.hpp"
#include "tpm/sweep/sweep_result.hpp"

namespace tpm::test {
using namespace sweep;

inline Sweep parsed(std::string_view text) {
  return parse_sweep(parse_json(text, "sweep"), "sweep", ".");
}

/// The whole sweep as blocks of one runner.
inline std::vector<CellBlock> all_blocks(const Sweep& sweep) {
  CellRunner runner(sweep);
  std::vector<CellBlock> blocks;
  for (std::uint64_t b = 0; b < sweep.blocks(); ++b) blocks.push_back(runner.run(b));
  return blocks;
}

inline CellBlock only_block(const Sweep& sweep) {
  REQUIRE(sweep.blocks() == 1);
  return all_blocks(sweep).front();
}

/// Runs to the end and writes; the bytes of the HDF5 file.
inline std::string result_of(const Sweep& sweep, const std::string& file,
                             const SweepControls& controls = {}) {
  BlockLog log(log_path(file), sweep, {});
  const SweepRun run = run_sweep(sweep, log, controls);
  REQUIRE_FALSE(run.interrupted);
  static_cast<void>(write_sweep(sweep, {&log}, file, controls.workers));
  return read_file(file);
}

/// Three axes, conditions, failures, a curve and a formula, in blocks that end within rows.
inline constexpr const char* kMixed = R"({"model": "single_contact", "block": 7,
  "material": {"eta1": "240 kPa s"},
  "indentation": {"kind": "ramp_hold", "depth": "8 mm", "hold": "10 s"},
  "axes": [{"parameter": "rate", "values": ["1 mm/s", "-1 mm/s", "4 mm/s"]},
           {"parameter": "E1", "from": "6 kPa", "to": "24 kPa", "count": 4, "scale": "log"},
           {"parameter": "spacing", "name": "x", "from": "10 mm", "to": "40 mm", "count": 5}],
  "skip": [{"when": "x < 0.011", "reason": "too close"}],
  "outputs": ["peak_force", {"force_over": {"from": "0 s", "to": "10 s", "count": 6}, "name": "force"},
              "end_force", {"formula": "end_force / peak_force", "name": "share"}]})";

}  // namespace tpm::test
