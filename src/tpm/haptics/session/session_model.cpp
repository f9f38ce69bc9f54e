// Declared in tpm/haptics/session/session.hpp.
#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/haptics/session/planned_model.hpp"
#include "tpm/organ/bonds/material_refusal.hpp"
#include "tpm/plan/plan_model.hpp"

namespace tpm::haptics {
namespace {

/// Throws Error(bad_input) that names the formulations of sessions that can, unless this one takes
/// the materials of the session's scene.
void require_materials(const Formulation& formulation, const HilSession& session) {
  const Tissue tissue = parse_tissue(session.scene, session.scene_place, {});
  std::vector<MaterialNeed> needs = needs_of(tissue.bonds());
  for (const MaterialNeed need : needs_of(tissue.materials)) needs.push_back(need);
  for (const MaterialNeed need : needs) {
    if (formulation.can().*need) continue;
    refuse_capability(formulation, need, session.scene_place.where,
                      formulations_that([&](const Formulation& other) {
                        return other.can().*need && for_sessions(other);
                      }));
  }
}

LoopModel model_of(const HilSession& session, const PlanningTold& told) {
  if (session.model == kPlannedModel) return planned_model(session, told);
  const Formulation* formulation = find_formulation(session.model);
  if (formulation == nullptr || !for_sessions(*formulation)) {
    refuse_formulation(session.model, "model", "session", formulations_that(for_sessions));
  }
  if (!session.law) require_materials(*formulation, session);
  if (const auto* maker = formulation->as<LoopMaker>()) return maker->loop(session);
  return offered_loop(*formulation, session);
}

}  // namespace

bool for_sessions(const Formulation& formulation) {
  return formulation.as<LoopMaker>() != nullptr ||
         (formulation.can().servo && formulation.as<PlanOffer>() != nullptr);
}

LoopModel make_loop_model(const HilSession& session, const PlanningTold& told) {
  LoopModel loop = model_of(session, told);
  if (!session.law) {
    const BondSystem bonds = parse_tissue(session.scene, session.scene_place, {}).bonds();
    const std::span<const double> times_s = bonds.relaxation_times_s();
    loop.relaxation_times_s.assign(times_s.begin(), times_s.end());
  }
  loop.stiffness_N_per_m = loop.push.dot(loop.model->instantaneous_stiffness() * loop.push);
  return loop;
}

}  // namespace tpm::haptics
