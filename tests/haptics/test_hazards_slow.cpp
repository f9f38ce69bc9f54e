// Hazards that need a clock. Other programs may stall the machine: each row is tried more than
// once.
#include <algorithm>
#include <catch2/catch.hpp>

#include "tpm/haptics/show/hazard_report.hpp"

namespace tpm::haptics {
namespace {

TEST_CASE("On the clock, too, every hazard ends as it should, and in time") {
  std::size_t told = 0;
  const ClockHazardStudy study = study_hazards_on_the_clock([&told] { ++told; });
  CHECK(told == clock_hazard_count());
  REQUIRE(study.rows.size() == clock_hazard_count());
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
  CHECK(clock_hazard_json(study).at("rows").size() == study.rows.size());
}

}  // namespace
}  // namespace tpm::haptics
