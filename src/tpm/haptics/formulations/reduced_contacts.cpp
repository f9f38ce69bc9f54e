// The contact seen by itself: reductions of a network that a servo can step.
#include <fmt/format.h>

#include "tpm/base/text.hpp"
#include "tpm/contact/condensed/condensed.hpp"
#include "tpm/contact/element_contact.hpp"
#include "tpm/haptics/session/loop_maker.hpp"
#include "tpm/haptics/session/pushed_scene.hpp"
#include "tpm/organ/scene/scene_keys.hpp"
#include "tpm/plan/plan_model.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
using namespace haptics;
namespace {

/// A formulation that is one or several candidates of plans, and runs scenes as one of them.
class ReducedContact : public Formulation, public SceneRunner, public PlanOffer {
 public:
  /// @param which of the candidates a scene's block `formulation` names
  ReducedContact(Entry entry, PlanModels (*offered)(),
                 std::size_t (*which)(const FormulationChoice&))
      : Formulation(std::move(entry)), offered_(offered), which_(which) {}

  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& /*network*/,
                               const std::vector<double>& times_s, bool with_field) const override {
    return run_candidate_on(*offered_().at(which_(scene.formulation)), scene, times_s, with_field);
  }
  [[nodiscard]] PlanModels candidates(const PlanScene& /*scene*/) const override {
    return offered_();
  }

 private:
  PlanModels (*offered_)();
  std::size_t (*which_)(const FormulationChoice&);
};

/// One that sessions step in a way of its own.
class ReducedLoop final : public ReducedContact, public LoopMaker {
 public:
  ReducedLoop(Entry entry, PlanModels (*offered)(), LoopModel (*made)(const HilSession&))
      : ReducedContact(std::move(entry), offered,
                       [](const FormulationChoice&) { return std::size_t{0}; }),
        made_(made) {}
  [[nodiscard]] LoopModel loop(const HilSession& session) const override { return made_(session); }

 private:
  LoopModel (*made_)(const HilSession&);
};

LoopModel element_model(const HilSession& session) {
  const SceneKeys scene = scene_block().made(session.scene, session.scene_place);
  const Tissue tissue = tissue_of(scene, session.scene_place, {});
  if (scene.organ.kind != OrganKind::star) {
    throw bad_input(session.scene_place.where, "is no star",
                    "an organ of the kind star for the model 'element'");
  }
  LoopModel loop;
  loop.model =
      std::make_unique<ElementContact>(tissue.element("the element"), session.servo.period_s);
  loop.name = "element: the paper's star, exact exponential update";
  loop.error_bound = "exact for linear motion within a period, to rounding";
  const std::size_t contact = tissue.network.organ.contact.value();
  loop.shape = shape_of(tissue.network, contact,
                        -tissue.network.organ.normal.col(static_cast<Eigen::Index>(contact)));
  return loop;
}

LoopModel condensed_model(const HilSession& session) {
  const PushedScene scene(session);
  CondensedOptions options;
  options.depth_m = scene.deepest_m;
  options.period_s = session.servo.period_s;
  const CondensedContact condensed =
      build_condensed(scene.tissue.bonds(), scene.rest(), scene.tissue.constraints(),
                      scene.only_sphere(), scene.probe().direction, options);
  LoopModel loop = scene.begun("condensed", "seen from");
  loop.model = std::make_unique<CondensedContact>(condensed);
  loop.shape.field = std::make_shared<CondensedContact>(condensed.with_period(kDrawnEvery_s));
  loop.error_bound = fmt::format("fitted to {} mm of depth; tpm hil verify measures it",
                                 significant(1e3 * options.depth_m, 4));
  return loop;
}

LoopModel network_model(const HilSession& session) {
  const PushedScene scene(session);
  LoopModel loop = scene.begun("network", "stepped every period, pushed at");
  loop.model = scene.network(session.servo.period_s);
  loop.shape.field = scene.network(kDrawnEvery_s);
  loop.error_bound = "its own estimate, row by row; tpm hil verify measures it";
  return loop;
}

std::size_t by_exponentials(const FormulationChoice& choice) {
  return static_cast<std::size_t>(choice.exponentials) - 1;
}

/// Formulations of one contact along its push, whatever drives it.
constexpr Capabilities kAlongPush{.network = true,
                                  .depth = true,
                                  .load = true,
                                  .jumps = true,
                                  .field = true,
                                  .several_contacts = true,
                                  .servo = true,
                                  .planned = true,
                                  .branches = true,
                                  .stiffening = true,
                                  .any_potential = true,
                                  .regions = true};
/// Formulations of one sphere that moves in space.
constexpr Capabilities kInSpace{.network = true,
                                .depth = true,
                                .servo = true,
                                .planned = true,
                                .branches = true,
                                .stiffening = true,
                                .regions = true};

Capabilities with_any_potential(Capabilities can) {
  can.any_potential = true;
  return can;
}

Capabilities without_field(Capabilities can) {
  can.field = false;
  return can;
}

}  // namespace

Formulations reduced_contacts_formulations() {
  static const ReducedContact linear({"linear",
                                      "the contact as a linear one with some exponentials",
                                      kAlongPush,
                                      100,
                                      {"exponentials", "step"}},
                                     linear_candidates, by_exponentials);
  static const ReducedLoop element(
      {"element",
       "the paper's element with the contact's stiffness; in sessions the star itself",
       kAlongPush,
       110,
       {"step"}},
      element_candidates, element_model);
  static const ReducedContact curves(
      {"curves",
       "static curves of the network, instantaneous and at equilibrium, with some exponentials",
       without_field(kAlongPush),
       120,
       {"exponentials", "step"}},
      curves_candidates, by_exponentials);
  static const ReducedLoop condensed(
      {"condensed",
       "the network on its slow manifold, seen from its contact sphere",
       with_any_potential(kInSpace),
       130,
       {"step"}},
      condensed_candidates, condensed_model);
  static const ReducedLoop network(
      {"servo_network",
       "the whole network in every period, with a stiffness factorised beforehand",
       kInSpace,
       145,
       {"step"},
       "network"},
      servo_network_candidates, network_model);
  static const std::vector<const Formulation*> all{&linear, &element, &curves, &condensed,
                                                   &network};
  return all;
}

}  // namespace tpm::haptics
