#include <fmt/format.h>

#include <algorithm>

#include "tpm/core/error.hpp"
#include "tpm/core/text.hpp"
#include "tpm/haptics/element_contact.hpp"
#include "tpm/haptics/session.hpp"
#include "tpm/reduce/condensed.hpp"
#include "tpm/scene/experiment_blocks.hpp"

namespace tpm {
namespace {

constexpr const char* kScenePlace = "model: scene";

TissueShape shape_of(const Network& network, std::size_t contact, const Eigen::Vector3d& push) {
  TissueShape shape;
  shape.rest_m = network.organ.position;
  shape.radius_m = network.organ.radius;
  shape.contact = contact;
  shape.push = push;
  for (const Bond& bond : network.bonds) shape.bonds.emplace_back(bond.a, bond.b);
  return shape;
}

LoopModel element_model(const HilSession& session) {
  const Tissue tissue = parse_tissue(session.scene, kScenePlace, session.folder);
  if (session.scene.at("organ").value("kind", "") != "star") {
    throw bad_input(kScenePlace, "is no star", "an organ of the kind star for the model 'element'");
  }
  LoopModel loop;
  loop.model = std::make_unique<ElementContact>(tissue.material, session.servo.period_s);
  loop.name = "element: the paper's star, exact exponential update";
  loop.error_bound = "exact for linear motion within a period, to rounding";
  const std::size_t contact = tissue.network.organ.contact.value();
  loop.shape = shape_of(tissue.network, contact,
                        -tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact)));
  return loop;
}

/// As deep as the session goes, with some room for an operator that goes deeper.
double deepest_m(const HilSession& session) {
  constexpr double kRoom = 1.1, kUnderLoads_m = 0.010;  // to the limit of the paper's validity
  double deepest = 0.0;
  for (const SessionPhase& phase : session.phases) {
    deepest = std::max(deepest, kRoom * phase.depth_m);
    if (phase.kind == SessionPhaseKind::load) deepest = std::max(deepest, kUnderLoads_m);
  }
  return deepest;
}

LoopModel condensed_model(const HilSession& session) {
  const Tissue tissue = parse_tissue(session.scene, kScenePlace, session.folder);
  require_standing(tissue, kScenePlace);
  const Probe probe =
      parse_contacts(Json::array({{{"kind", "sphere"}}}), tissue, DocumentPlace{kScenePlace})
          .front()
          .probe;
  CondensedOptions options;
  options.depth_m = deepest_m(session);
  options.period_s = session.servo.period_s;
  const CondensedContact condensed =
      build_condensed(tissue.bonds(), tissue.network.organ.position, tissue.freedom(), probe.sphere,
                      probe.direction, options);
  LoopModel loop;
  loop.model = std::make_unique<CondensedContact>(condensed);
  loop.push = probe.direction;
  loop.shape = shape_of(tissue.network, probe.sphere, probe.direction);
  loop.shape.field = std::make_shared<CondensedContact>(condensed.with_period(kDrawnEvery_s));
  loop.name = fmt::format("condensed: {} spheres seen from sphere {}", tissue.network.organ.size(),
                          probe.sphere + 1);
  loop.error_bound = fmt::format("fitted to {} mm of depth; what tpm hil verify measures",
                                 significant(1e3 * options.depth_m, 4));
  return loop;
}

LoopModel model_of(const HilSession& session) {
  switch (session.model) {
    case LoopModelKind::element:
      return element_model(session);
    case LoopModelKind::condensed:
      break;
  }
  return condensed_model(session);
}

}  // namespace

LoopModel make_loop_model(const HilSession& session) {
  LoopModel loop = model_of(session);
  loop.stiffness_N_per_m = loop.push.dot(loop.model->instantaneous_stiffness() * loop.push);
  return loop;
}

}  // namespace tpm
