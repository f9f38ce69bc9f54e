#include "tpm/haptics/session/surface_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/text.hpp"
#include "tpm/contact/surface_network.hpp"

namespace tpm::haptics {
namespace {

/// Depth of an organ's surface along a straight way across the push, from where a ball touches it.
class SurfaceAlong {
 public:
  static constexpr double kStep_m = 0.5e-3;

  /// @param aside unit vector, in the coordinates of the scene
  SurfaceAlong(const SurfaceScene& surface, const Eigen::Vector3d& aside, double way_m) {
    const auto count = static_cast<int>(std::ceil(way_m / kStep_m)) + kReach;
    const auto met = [&](int i) {
      return surface.ball.depth_to_touch_m(surface.scene.rest(), i * kStep_m * aside,
                                           surface.scene.probe().direction);
    };
    met_m_.assign(static_cast<std::size_t>(count) + std::size_t{kReach} + 1, 0.0);
    for (int i = 1; i <= count; ++i) value(i) = met(i).value_or(value(i - 1));
    for (int i = -1; i >= -kReach; --i) value(i) = met(i).value_or(value(i + 1));
    begin_m_ = averaged(0);
  }

  /// 0 at the start.
  [[nodiscard]] double at(double across_m) const {
    const double place = across_m / kStep_m;
    const double below = std::floor(place), part = place - below;
    const int i = static_cast<int>(below);
    const double here = averaged(i);
    return here + (part > 0.0 ? part * (averaged(i + 1) - here) : 0.0) - begin_m_;
  }

 private:
  // To either side: what a hand makes of the edge where one sphere ends and the next begins.
  static constexpr int kAverage = 4, kReach = kAverage + 1;

  [[nodiscard]] double& value(int i) { return *(met_m_.begin() + (i + kReach)); }
  [[nodiscard]] double averaged(int i) const {
    const auto first = met_m_.begin() + (i + kReach - kAverage);
    constexpr int kCount = 2 * kAverage + 1;
    return std::accumulate(first, first + kCount, 0.0) / kCount;
  }

  std::vector<double> met_m_;
  double begin_m_ = 0.0;
};

}  // namespace

SurfaceScene::SurfaceScene(const HilSession& session)
    : scene(session),
      ball(ball_on_surface(scene.tissue.network.organ, scene.only_sphere(), scene.probe().direction,
                           session.tool_radius_m, session.contact_stiffness_N_per_m)),
      to_model(turn_onto(session.servo.push, scene.probe().direction)) {}

void follow_surface(HilSession& session) {
  double way_m = 0.0;
  for (const SessionPhase& phase : session.phases) {
    way_m = std::max({way_m, phase.across_from_m, phase.across_to_m});
  }
  if (session.model != "surface" || !(way_m > 0.0)) return;
  const SurfaceScene surface(session);
  const SurfaceAlong along(surface, surface.to_model * session.slide, way_m);
  for (SessionPhase& phase : session.phases) {
    const double length_m = std::abs(phase.across_to_m - phase.across_from_m);
    if (!(length_m > 0.0)) continue;
    const auto parts = static_cast<std::size_t>(std::ceil(length_m / SurfaceAlong::kStep_m));
    phase.surface_m.clear();
    for (std::size_t i = 0; i <= parts; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(parts);
      phase.surface_m.push_back(
          along.at(phase.across_from_m + part * (phase.across_to_m - phase.across_from_m)));
    }
  }
}

LoopModel surface_model(const HilSession& session) {
  // A sphere that the ball touches on its flank moves further than the ball is deep.
  constexpr double kLeastRange_m = 10e-3, kRoomAside = 1.5;
  const SurfaceScene surface(session);
  const PushedScene& scene = surface.scene;
  const BondSystem bonds = scene.tissue.bonds();
  const Constraints constraints = scene.tissue.constraints();
  const auto network = [&](double period_s) {
    const SurfaceNetworkOptions options{
        .period_s = period_s, .deepest_m = std::max(kLeastRange_m, kRoomAside * scene.deepest_m)};
    return std::make_unique<SurfaceNetwork>(bonds, scene.rest(), constraints, surface.ball,
                                            options);
  };
  LoopModel loop = scene.begun(
      "surface", fmt::format("under a ball of {} mm that moves over them in space, starting at",
                             significant(1e3 * session.tool_radius_m, 4)));
  loop.model = network(session.servo.period_s);
  loop.to_model = surface.to_model;
  loop.shape.field = network(kDrawnEvery_s);
  loop.shape.to_model = surface.to_model;
  loop.shape.tool_radius_m = session.tool_radius_m;
  loop.shape.tool_start_m = surface.ball.start_m;
  loop.error_bound = fmt::format(
      "its own estimate, row by row; tpm hil verify measures it; ball and sphere overlap by "
      "1 mm under {} N, in the reference too",
      significant(1e-3 * session.contact_stiffness_N_per_m, 4));
  return loop;
}

}  // namespace tpm::haptics
