#include "tpm/haptics/session/pushed_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tpm/organ/scene/experiment_blocks.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
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

SceneContact moved_contact(const HilSession& session, const Tissue& tissue) {
  if (session.contact.is_null()) return usual_contact(tissue, session.scene_place);
  return parse_contact(session.contact, tissue, session.contact_place);
}

PushedScene::PushedScene(const HilSession& session)
    : model(session.model),
      contact_place(session.contact_place.where),
      tissue(parse_tissue(session.scene, session.scene_place, {})),
      deepest_m(deepest_of(session)) {
  require_standing(tissue, session.scene_place.where);
  if (session.contact.is_null()) require_free_contact(tissue, session.scene_place.where);
  contact = moved_contact(session, tissue);
}

std::size_t PushedScene::only_sphere() const {
  if (contact.kind == ContactKind::sphere) return probe().sphere;
  throw bad_input(contact_place,
                  fmt::format("a {}, and the model '{}' is pushed at one sphere",
                              to_string(contact.kind), model),
                  "a sphere, or a model that moves several: planned, linear, curves");
}

LoopModel PushedScene::begun(std::string_view kind, std::string_view how) const {
  LoopModel loop;
  loop.push = probe().direction;
  loop.shape = shape_of(tissue.network, probe().sphere, probe().direction);
  loop.name = fmt::format("{}: {} spheres {} sphere {}", kind, tissue.network.organ.size(), how,
                          probe().sphere + 1);
  if (contact.kind != ContactKind::sphere) {
    loop.name += fmt::format(" and {} around it that move with it",
                             spheres_of(contact, tissue.network.organ).size() - 1);
  }
  return loop;
}

std::unique_ptr<ServoNetwork> PushedScene::network(double period_s) const {
  const ServoNetworkOptions options{
      .period_s = period_s, .frozen_depth_m = 0.5 * deepest_m, .deepest_m = deepest_m};
  return std::make_unique<ServoNetwork>(tissue.bonds(), rest(), tissue.constraints(), only_sphere(),
                                        probe().direction, options);
}

}  // namespace tpm::haptics
