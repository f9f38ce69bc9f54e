#include "tpm/haptics/pushed_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/scene/experiment_blocks.hpp"

namespace tpm {
namespace {

double deepest_of(const HilSession& session) {
  constexpr double kRoom = 1.1, kUnderLoads_m = 0.010;  // to the limit of the paper's validity
  double deepest = 0.0;
  for (const SessionPhase& phase : session.phases) {
    deepest = std::max(deepest, kRoom * phase.depth_m);
    if (phase.kind == SessionPhaseKind::load) deepest = std::max(deepest, kUnderLoads_m);
  }
  return deepest;
}

}  // namespace

TissueShape shape_of(const Network& network, std::size_t contact, const Eigen::Vector3d& push) {
  TissueShape shape;
  shape.rest_m = network.organ.position;
  shape.radius_m = network.organ.radius;
  shape.contact = contact;
  shape.push = push;
  for (const Bond& bond : network.bonds) shape.bonds.emplace_back(bond.a, bond.b);
  return shape;
}

PushedScene::PushedScene(const HilSession& session)
    : tissue(parse_tissue(session.scene, session.scene_place, {})), deepest_m(deepest_of(session)) {
  require_standing(tissue, session.scene_place);
  probe = usual_contact(tissue, DocumentPlace{session.scene_place}).probe;
}

LoopModel PushedScene::begun(std::string_view kind, std::string_view how) const {
  LoopModel loop;
  loop.push = probe.direction;
  loop.shape = shape_of(tissue.network, probe.sphere, probe.direction);
  loop.name = fmt::format("{}: {} spheres {} sphere {}", kind, tissue.network.organ.size(), how,
                          probe.sphere + 1);
  return loop;
}

std::unique_ptr<ServoNetwork> PushedScene::network(double period_s) const {
  const ServoNetworkOptions options{
      .period_s = period_s, .frozen_depth_m = 0.5 * deepest_m, .deepest_m = deepest_m};
  return std::make_unique<ServoNetwork>(tissue.bonds(), rest(), tissue.constraints(), probe.sphere,
                                        probe.direction, options);
}

}  // namespace tpm
