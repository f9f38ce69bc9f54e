// Options of tpm hil that are out of range: each is named, with the range that it has.
#include <catch2/catch.hpp>
#include <string>

#include "hil_scenes.hpp"
#include "run_in.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

TEST_CASE("A port that cannot be had is refused with the range of ports") {
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(test::short_session()));
  for (const char* const option :
       {"hil run session.json --page", "hil serve session.json --page",
        "hil serve session.json --port", "hil serve session.json --events-port"}) {
    for (const char* const port :
         {"80", "65536", "1000000000000", "abc", "1.5", "0x400", "10.0.0.1"}) {
      CAPTURE(option, port);
      const test::ProgramRun run = test::run_in(folder, std::string(option) + " " + port);
      CHECK(run.code == 2);
      CHECK_THAT(run.said, Contains("expected 0 for a port that is free, or 1024 to 65535") &&
                               Contains(port));
    }
  }
}

TEST_CASE("A session that has ended names the command that verifies it") {
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(test::short_session()));
  const test::ProgramRun run = test::run_in(folder, "hil run session.json -o 's 1.tpmrec'");
  CHECK(run.code == 0);
  CHECK_THAT(run.said, Contains("wrote s 1.tpmrec\nnext: tpm hil verify 's 1.tpmrec'\n"));
  // No recording is replaced, also not by the same session under the default name.
  CHECK(test::run_in(folder, "hil run session.json").code == 0);
  const test::ProgramRun again = test::run_in(folder, "hil run session.json");
  CHECK(again.code == 2);
  CHECK_THAT(again.said, Contains("-o session.tpmrec: the file exists; expected another"));
}

TEST_CASE("An option of a verification that is out of range is named") {
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(test::short_session()));
  REQUIRE(test::run_in(folder, "hil run session.json -o s.tpmrec").code == 0);
  for (const char* const option :
       {"--motion-tolerance '0 um'", "--compare-every '0 s'", "--window '-1 s'"}) {
    CAPTURE(option);
    const test::ProgramRun run = test::run_in(folder, std::string("hil verify s.tpmrec ") + option);
    CHECK(run.code == 2);
    CHECK_THAT(run.said, Contains(std::string(option).substr(0, std::string(option).find(' '))) &&
                             Contains("expected a "));
  }
}

}  // namespace
}  // namespace tpm::haptics
