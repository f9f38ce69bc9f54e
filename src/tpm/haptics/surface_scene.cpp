#include "tpm/haptics/surface_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/core/text.hpp"
#include "tpm/reduce/surface_network.hpp"

namespace tpm {

Eigen::Matrix3d turn_onto(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  constexpr double kOpposite = 1e-9;
  const double cosine = from.dot(to);
  if (cosine < -1.0 + kOpposite) {  // every half turn about an axis across is the smallest
    const Eigen::Vector3d axis = from.unitOrthogonal();
    return 2.0 * axis * axis.transpose() - Eigen::Matrix3d::Identity();
  }
  const Eigen::Vector3d axis = from.cross(to);
  Eigen::Matrix3d cross;
  cross << 0.0, -axis.z(), axis.y(), axis.z(), 0.0, -axis.x(), -axis.y(), axis.x(), 0.0;
  return Eigen::Matrix3d::Identity() + cross + cross * cross / (1.0 + cosine);
}

SurfaceScene::SurfaceScene(const HilSession& session)
    : scene(session),
      ball(ball_on_surface(scene.tissue.network.organ, scene.probe.sphere, scene.probe.direction,
                           session.tool_radius_m, session.contact_stiffness_N_per_m)),
      to_model(turn_onto(session.servo.push, scene.probe.direction)) {}

LoopModel surface_model(const HilSession& session) {
  // A sphere that the ball touches on its flank moves further than the ball is deep.
  constexpr double kLeastRange_m = 10e-3, kRoomAside = 1.5;
  const SurfaceScene surface(session);
  const PushedScene& scene = surface.scene;
  const BondSystem bonds = scene.tissue.bonds();
  const Freedom freedom = scene.tissue.freedom();
  const auto network = [&](double period_s) {
    const SurfaceNetworkOptions options{
        .period_s = period_s, .deepest_m = std::max(kLeastRange_m, kRoomAside * scene.deepest_m)};
    return std::make_unique<SurfaceNetwork>(bonds, scene.rest(), freedom, surface.ball, options);
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
      "its own estimate, row by row; what tpm hil verify measures; ball and sphere overlap by "
      "1 mm under {} N, in the reference too",
      significant(1e-3 * session.contact_stiffness_N_per_m, 4));
  return loop;
}

}  // namespace tpm
