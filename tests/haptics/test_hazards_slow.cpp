// Hazards that need a clock. Other programs may stall the machine: each row is tried more than
// once.
#include <algorithm>
#include <catch2/catch.hpp>

#include "hazards/hazard_report.hpp"

namespace tpm::haptics {
namespace {

TEST_CASE("On the clock, too, every hazard ends as it should, and in time") {
  const ClockHazardStudy study = study_hazards_on_the_clock();
  REQUIRE(study.rows.size() >= 18);
  for (const ClockHazardRow& row : study.rows) {
    CAPTURE(row.hazard, row.setting, word_of(row.cause), row.to_zero_s, row.tries);
    CHECK(row.within);
  }
  CHECK(study.safe());
  for (const StopCause cause :
       {StopCause::finished, StopCause::cycle_timeout, StopCause::watchdog,
        StopCause::overrun_storm, StopCause::signal, StopCause::exception}) {
    CAPTURE(word_of(cause));
    CHECK(std::any_of(study.rows.begin(), study.rows.end(),
                      [cause](const ClockHazardRow& row) { return row.cause == cause; }));
  }
  const std::string text = clock_hazard_text(study);
  CHECK(std::count(text.begin(), text.end(), '\n') ==
        static_cast<std::ptrdiff_t>(study.rows.size()) + 6);
}

}  // namespace
}  // namespace tpm::haptics
