// Hazards that need a clock. How soon forces are off is measured (measure_hazards, the table of
// docs/safety.md); what is checked here holds on a machine that other programs stall, too.
#include <algorithm>
#include <catch2/catch.hpp>

#include "hazards/hazard_report.hpp"

namespace tpm::haptics {
namespace {

/// With what a session of a few seconds ends on a machine that has no time for it.
bool is_stop_of_a_stall(StopCause cause) {
  return cause == StopCause::watchdog || cause == StopCause::overrun_storm ||
         cause == StopCause::cycle_timeout;
}

TEST_CASE("On the clock, too, every hazard ends as it should, with forces within their limit") {
  const ClockHazardStudy study = study_hazards_on_the_clock(false);
  REQUIRE(study.rows.size() >= 18);
  for (const ClockHazardRow& row : study.rows) {
    CAPTURE(row.hazard, row.setting, to_string(row.cause), row.to_zero_s, row.tries);
    CHECK((row.cause == row.expected || is_stop_of_a_stall(row.cause)));
    CHECK(row.largest_force_N <= study.force_limit_N);
    CHECK(row.forces_off);  // of each try, also of one that a stall ended before its fault
    if (row.cause == StopCause::finished || !row.by_fault) continue;
    // Nobody waits for a call that takes long enough to tell.
    if (row.cause == StopCause::cycle_timeout && row.expected == row.cause && row.lasts_s > 0.1) {
      CHECK(row.to_zero_s < row.lasts_s);
    }
  }
  const auto ended = std::count_if(study.rows.begin(), study.rows.end(),
                                   [](const auto& row) { return row.cause == row.expected; });
  if (ended < static_cast<std::ptrdiff_t>(study.rows.size())) {
    WARN("the machine stalled: " << study.rows.size() - static_cast<std::size_t>(ended)
                                 << " rows ended by that, " << study.most_tries << " times each");
  }
  const std::string text = clock_hazard_text(study);
  CHECK(std::count(text.begin(), text.end(), '\n') ==
        static_cast<std::ptrdiff_t>(study.rows.size()) + 6);
}

}  // namespace
}  // namespace tpm::haptics
