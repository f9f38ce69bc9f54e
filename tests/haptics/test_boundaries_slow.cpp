// The stability boundary with impact, for each limit of the rise.
#include <catch2/catch.hpp>

#include "expected_values.hpp"
#include "tpm/haptics/boundary/boundary_study.hpp"
#include "tpm/haptics/session/rendering_check.hpp"
#include "tpm/haptics/show/boundary_report.hpp"

namespace tpm::haptics {

TEST_CASE("Up to what a session is allowed, impacts come to rest whatever limits the rise") {
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
}  // namespace tpm::haptics
