// What can go wrong in a session, in virtual time; boundaries with impact and limits of the rise.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "expected_values.hpp"
#include "hazards/hazard_report.hpp"
#include "tpm/haptics/boundary/boundary_study.hpp"
#include "tpm/haptics/session/rendering_check.hpp"
#include "tpm/haptics/show/boundary_report.hpp"

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

TEST_CASE("Up to what a session is allowed, impacts come to rest whatever limits the rise",
          "[heavy]") {
  const BoundaryStudy study = study_boundaries({});
  REQUIRE_FALSE(study.impacts.empty());
  std::size_t restless = 0;
  for (const ImpactPoint& p : study.impacts) {
    for (const RiseLimit limit : kRiseLimits) {
      const bool rests = p.rests[static_cast<std::size_t>(limit)];
      CAPTURE(p.delay_periods, p.speed_m_per_s, p.share, to_string(limit));
      if (p.share <= RenderingCheck::kRoom) CHECK(rests);
      if (!rests) ++restless;
    }
    // Where the linear loop is unstable, nothing but a limit can hold it.
    if (p.share > 1.2) CHECK_FALSE(p.rests[static_cast<std::size_t>(RiseLimit::none)]);
  }
  CHECK(restless > 50);
  const Json json = boundary_json(study);
  CHECK(json.at("worst_passive").get<double>() < test::allowed_error("boundaries.passive"));
  CHECK(json.at("worst_stable").get<double>() < test::allowed_error("boundaries.stable"));
  for (const Json& corner : json.at("device_corners")) {
    CHECK(corner.at("passive").is_null() == corner.at("assumed_friction_N_s_per_m").is_null());
  }
}

}  // namespace
}  // namespace tpm::haptics
