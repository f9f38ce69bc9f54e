// Sessions with a whole network in the loop, or beside it.
#include <catch2/catch.hpp>

#include "hil_scenes.hpp"
#include "temp_folder.hpp"
#include "tpm/core/error.hpp"
#include "tpm/haptics/session_run.hpp"
#include "tpm/haptics/verify.hpp"
#include "tpm/store/file.hpp"

namespace tpm {
namespace {

using Catch::Matchers::Contains;

struct Ran {
  HilRecording recording;
  std::string bytes;
};

Ran ran(const char* kind) {
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  const SessionRun run = run_session(test::parsed(test::network_session(kind)), {}, options);
  REQUIRE(run.outcome.cause == StopCause::finished);
  return {read_recording(folder / "r"), read_file(folder / "r")};
}

TEST_CASE("A session of the whole network verifies, stepped in the loop and beside it", "[heavy]") {
  VerifyOptions options;
  options.motion_tolerance_m = 2e-6;
  const Verification in_loop = verify(ran("network").recording, options);
  CHECK(in_loop.all.peak_N > 0.1);
  CHECK(in_loop.all.max_N < 0.001 * in_loop.all.peak_N);
  const Ran beside = ran("network_beside");
  const Verification v = verify(beside.recording, options);
  CHECK(v.all.max_N < 0.004 * v.all.peak_N);
  CHECK(beside.bytes == ran("network_beside").bytes);
}

TEST_CASE("A network beside the loop is for tissues that relax slowly") {
  const HilSession fast = test::parsed(test::network_session("network_beside", "1e3 Pa s"));
  CHECK_THROWS_WITH(make_loop_model(fast), Contains("too short for the model 'network_beside'"));
}

}  // namespace
}  // namespace tpm
