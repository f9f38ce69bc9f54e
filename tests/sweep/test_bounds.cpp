// What lies outside of what can be computed is refused or counted as failed, never as a result.
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/import/import.hpp"
#include "tpm/sweep/cell_block.hpp"
#include "tpm/sweep/sweep.hpp"
#include "tpmkit/curve_file.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::sweep {
namespace {

using Catch::Matchers::Contains;

TEST_CASE("a cell whose number overflowed has failed and says which") {
  const Sweep sweep = parse_sweep(parse_json(R"({"model": "single_contact",
  "material": {"eta1": "240 kPa s"},
  "indentation": {"kind": "step_hold", "depth": "8 mm", "hold": "10 s"},
  "axes": [{"parameter": "depth", "values": ["4 mm", "1e200 m", "8 mm"]}],
  "outputs": ["lambda1"]})",
                                             "sweep"),
                                  "sweep", ".");
  const CellBlock block = CellRunner(sweep).run(0);
  REQUIRE(block.cells() == 3);
  for (const std::size_t cell : {0U, 2U}) {
    CHECK(block.status[cell] == CellStatus::done);
    CHECK(std::isfinite(block.values[0][cell]));
  }
  CHECK(block.status[1] == CellStatus::failed);
  CHECK(std::isnan(block.values[0][1]));
  REQUIRE(block.reason[1] > 0);
  CHECK_THAT(block.reasons[block.reason[1] - 1U], Contains("lambda1: nan is no finite number"));
}

TEST_CASE("times that nobody measures are refused") {
  const auto refusal = [](double hold_s) {
    return test::refusal_of([&] { static_cast<void>(ramp_and_hold(4e-3, 4e-3, hold_s)); });
  };
  CHECK(refusal(1e9).empty());
  CHECK_THAT(refusal(1e200), Contains("at 1e+200 s; expected times within 1e15 s of 0"));
  CHECK_THAT(test::refusal_of([] { static_cast<void>(ramp_and_hold(4e-3, 1e-200, 1.0)); }),
             Contains("expected times within 1e15 s"));
  CHECK_THAT(test::refusal_of([] { static_cast<void>(creep(0.1, 1e200)); }),
             Contains("expected times within 1e15 s"));
  CHECK_NOTHROW(creep(0.1, INFINITY));  // without an end is another thing

  const test::TempFolder folder;
  write_file(folder / "c.json", R"({"id": "c", "title": "t", "kind": "recording",
"observable": "contact_force", "provenance": "measured",
"columns": {"time_s": {"quantity": "time", "unit": "s"},
            "force_N": {"quantity": "contact_force", "unit": "N"}}})");
  write_file(folder / "c.csv", "time_s,force_N\n0,1\n1e200,2\n");
  CHECK_THAT(test::refusal_of([&] { static_cast<void>(load_curve(folder / "c.csv")); }),
             Contains("c.csv:3: column 'time_s'") && Contains("expected times within 1e15 s"));
}

}  // namespace
}  // namespace tpm::sweep
