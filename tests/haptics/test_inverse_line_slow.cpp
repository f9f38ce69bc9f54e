// tpm hil run --device inverse3 on tpm hil serve, as a user would: programs of their own and the
// clock. How exactly delays are found on a machine that does nothing else is measured
// (measure_inverse_line); in virtual time test_inverse_device_threads checks it.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>

#include "inverse_line.hpp"

namespace tpm::haptics {
namespace {

/// Of a machine that has no time for a session, or of a delay that grew while it had none.
bool is_of_a_stall(const std::string& end) {
  constexpr std::array kEnds{"watchdog of the device",
                             "unplugged",
                             "communication error",
                             "overrun storm",
                             "cycle timeout",
                             "energy given to the hand",
                             "oscillation"};
  return std::find(kEnds.begin(), kEnds.end(), end) != kEnds.end();
}

bool names_a_stall(const std::vector<std::string>& codes) {
  return std::ranges::any_of(codes, [](const std::string& code) {
    return code.starts_with("stalled") || code == "ended";
  });
}

TEST_CASE("By the command line, a delay is found or the stall named, and each session verified") {
  for (const int late_ms : {0, 2, 5}) {
    // Another try if the machine left nothing to look at; what is seen has to hold in each.
    constexpr int kMostRuns = 3;
    bool whole = false;
    for (int tries = 0; tries < kMostRuns && !whole; ++tries) {
      const test::LineRun run = test::run_on_the_line(TPM_TEST_PROGRAM, late_ms);
      CAPTURE(late_ms, tries);
      INFO(run.said);
      if (run.identified == 5) {  // a stall ended it for good
        CHECK(run.said.find("tpm: identification ended after ") != std::string::npos);
        continue;
      }
      REQUIRE(run.identified <= 1);
      REQUIRE(run.identified >= 0);
      if (run.identified == 1) {
        CHECK(names_a_stall(run.not_identified));
        continue;
      }
      // A machine that stalls makes forces later, never earlier; known to half a period.
      REQUIRE(run.found_s);
      CHECK(*run.found_s >= 1e-3 * late_ms - 0.5e-3);
      CHECK(*run.largest_s >= *run.found_s);
      if (run.verified < 0) continue;  // ended before the hand was in place
      if (run.cycles < 2) {  // a stall of the machine ended it as it began: nothing to verify
        CHECK(is_of_a_stall(run.end));
        CHECK(run.verified == 3);
        continue;
      }
      REQUIRE(run.verified == 0);
      CHECK((run.ran == 0) == (run.end == "finished"));
      CHECK((run.end == "finished" || is_of_a_stall(run.end)));
      constexpr double kFelt_N = 0.05;
      CHECK(run.largest_difference_N < 0.01 * std::max(run.peak_N, kFelt_N));
      whole = run.end == "finished" && run.peak_N > kFelt_N;
    }
    if (!whole) WARN("no session was whole: the machine stalled in each");
  }
}

TEST_CASE("An identification whose service is killed fails, and says why") {
  const test::TempFolder folder;
  files::write_file(folder / "session.json", test::rendered().dump());
  const std::string file = folder / "inverse.json";
  auto service =
      std::make_unique<test::ServeBeside>(TPM_TEST_PROGRAM, folder, test::served(2, false));
  std::vector<std::string> words{TPM_TEST_PROGRAM, "hil",  "identify", folder / "session.json",
                                 "--duration",     "60 s", "-o",       file};
  service->add_address(words);
  test::Beside identify(words, folder / "out", folder / "err");
  REQUIRE(test::until(
      [&] { return test::text_of(folder / "err").find("tpm: measuring") != std::string::npos; },
      120.0));
  std::this_thread::sleep_for(std::chrono::seconds(1));
  service.reset();
  CHECK(identify.wait_for() == 5);
  CHECK(test::text_of(folder / "err").find("tpm: identification ended after ") !=
        std::string::npos);
}

}  // namespace
}  // namespace tpm::haptics
