#include "tpm/haptics/loop_maker.hpp"
#include "tpm/haptics/planned_model.hpp"
#include "tpm/plan/plan_model.hpp"

namespace tpm {
namespace {

LoopModel model_of(const HilSession& session, bool threads, const PlanningTold& told) {
  if (session.model == kPlannedModel) return planned_model(session, told);
  const Formulation* formulation = find_formulation(session.model);
  if (formulation == nullptr || !for_sessions(*formulation)) {
    refuse_formulation(session.model, "model", "session", formulations_that(for_sessions));
  }
  if (const auto* maker = formulation->as<LoopMaker>()) return maker->loop(session, threads);
  return offered_loop(*formulation, session);
}

}  // namespace

bool for_sessions(const Formulation& formulation) {
  return formulation.as<LoopMaker>() != nullptr ||
         (formulation.can().servo && formulation.as<PlanOffer>() != nullptr);
}

LoopModel make_loop_model(const HilSession& session, bool threads, const PlanningTold& told) {
  LoopModel loop = model_of(session, threads, told);
  if (!session.law) {
    const BondSystem bonds = parse_tissue(session.scene, session.scene_place, {}).bonds();
    const std::span<const double> times_s = bonds.relaxation_times_s();
    loop.relaxation_times_s.assign(times_s.begin(), times_s.end());
  }
  loop.stiffness_N_per_m = loop.push.dot(loop.model->instantaneous_stiffness() * loop.push);
  return loop;
}

}  // namespace tpm
