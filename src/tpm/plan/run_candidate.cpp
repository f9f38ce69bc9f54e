// Declared in tpm/plan/plan_model.hpp.
// Candidates of plans and runs of scenes, each as the other.
#include <algorithm>

#include "tpm/plan/plan_model.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

/// A formulation as it runs scenes, compared with the coarse run of the network.
class RunCandidate final : public PlanModel {
 public:
  explicit RunCandidate(const Formulation& formulation)
      : formulation_(formulation), runner_(*formulation.as<SceneRunner>()) {}

  [[nodiscard]] std::string name() const override { return std::string(formulation_.name()); }
  [[nodiscard]] std::string formulation() const override { return name(); }
  [[nodiscard]] std::string settings() const override { return ""; }
  [[nodiscard]] bool has_masses() const override { return formulation_.can().masses; }
  [[nodiscard]] std::optional<std::string> why_not(const PlanSurrogate& surrogate,
                                                   const PlanBudget& /*budget*/) const override {
    if (surrogate.wants_field() && !formulation_.can().field)
      return "knows the contact's force only";
    try {
      require_runnable(own(surrogate));
    } catch (const Error& refusal) {
      return refusal.what();
    }
    return std::nullopt;
  }
  [[nodiscard]] std::optional<std::string> why_no_servo() const override {
    if (formulation_.can().servo) return std::nullopt;
    return "its steps have no bound on the cost of a period";
  }
  [[nodiscard]] ModelClaim claim(const PlanSurrogate& surrogate,
                                 const PlanBudget& budget) const override {
    const Trajectory answer = run(surrogate, budget, surrogate.times());
    return {surrogate.claim_of(answer), answer.work,
            answer.work.times(1.0 / std::max(answer.steps, 1.0))};
  }
  [[nodiscard]] Trajectory run(const PlanSurrogate& surrogate, const PlanBudget& /*budget*/,
                               const std::vector<double>& times_s) const override {
    return runner_.run(own(surrogate), surrogate.scene().run_network(), times_s,
                       surrogate.wants_field());
  }

 private:
  [[nodiscard]] ExperimentScene own(const PlanSurrogate& surrogate) const {
    ExperimentScene scene = surrogate.scene().scene();
    scene.formulation.kind = name();
    return scene;
  }

  const Formulation& formulation_;
  const SceneRunner& runner_;
};

}  // namespace

std::unique_ptr<PlanModel> run_candidate(const Formulation& formulation) {
  return std::make_unique<RunCandidate>(formulation);
}

Trajectory run_candidate_on(const PlanModel& candidate, const ExperimentScene& scene,
                            const std::vector<double>& times_s, bool with_field) {
  constexpr double kUsualPeriod_s = 1e-3;
  PlanMeasure measure;
  measure.output = with_field ? PlanOutput::field : PlanOutput::force;
  PlanBudget budget;
  budget.rate_Hz = 1.0 / scene.formulation.step_s.value_or(kUsualPeriod_s);
  const PlanSurrogate surrogate(PlanScene(scene), measure, scene.formulation.masses);
  if (const auto reason = candidate.why_not(surrogate, budget)) {
    throw bad_input(scene.formulation.where,
                    "the formulation '" + scene.formulation.kind + "' has no answer: " + *reason,
                    "another formulation");
  }
  return candidate.run(surrogate, budget, times_s);
}

PlanModels plan_models(const PlanScene& scene) {
  PlanModels models;
  for (const Formulation* formulation : linked_formulations()) {
    if (!formulation->can().planned) continue;
    if (const auto* offer = formulation->as<PlanOffer>()) {
      for (auto& candidate : offer->candidates(scene)) models.push_back(std::move(candidate));
    } else if (formulation->as<SceneRunner>() != nullptr) {
      models.push_back(run_candidate(*formulation));
    }
  }
  return models;
}

}  // namespace tpm::plan
