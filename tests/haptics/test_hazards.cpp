// What can go wrong in a session, in virtual time.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "hazards/hazard_report.hpp"

namespace tpm::haptics {
namespace {

TEST_CASE("No hazard leaves its bounds, and nothing that is passive is refused", "[heavy]") {
  const HazardStudy study = study_hazards();
  CHECK(study.rows.size() >= 40);
  CHECK(study.safe());
  for (const HazardRow& row : study.rows) {
    CAPTURE(row.hazard, row.setting, row.refused, row.largest_force_N, row.delivered_J);
    CHECK(row.within);
    if (row.passive) CHECK(row.refused.empty());
    CHECK(std::isfinite(row.largest_force_N));
  }
  // The study is not vacuous: it meets refusals, stops of its own and sessions that go through.
  const auto count = [&](auto&& holds) {
    return std::count_if(study.rows.begin(), study.rows.end(), holds);
  };
  CHECK(count([](const HazardRow& r) { return !r.refused.empty(); }) >= 8);
  CHECK(count([](const HazardRow& r) { return r.cause == StopCause::finished; }) >= 15);
  CHECK(count([](const HazardRow& r) { return r.cause == StopCause::oscillation; }) >= 1);
  CHECK(count([](const HazardRow& r) { return r.cause == StopCause::energy; }) >= 1);
  CHECK(count([](const HazardRow& r) { return r.cause == StopCause::position_jump; }) >= 1);
  CHECK(count([](const HazardRow& r) { return r.unchecked; }) >= 4);
  CHECK(hazard_text(study) == hazard_text(study_hazards()));
}

}  // namespace
}  // namespace tpm::haptics
