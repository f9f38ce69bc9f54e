// The step rules of method/ on the network of a scene, one formulation each.

#include <memory>

#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/organ/steps/method.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

class StepRuleFormulation final : public Formulation, public SceneRunner {
 public:
  StepRuleFormulation(StepRule rule, Entry entry) : Formulation(std::move(entry)), rule_(rule) {}

  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                               const std::vector<double>& times_s,
                               bool /*with_field*/) const override {
    MethodSettings settings;
    settings.rule = rule_;
    settings.step_s = scene.formulation.step_s.value_or(settings.step_s);
    settings.tolerance = scene.formulation.tolerance;
    settings.sweeps = scene.formulation.sweeps;
    const MethodRun run = network_problem(network.driven, scene.protocol, masses(scene, network))
                              ->run(settings, times_s);
    if (run.end != MethodEnd::completed) {
      throw Error(ExitCode::numerical, name(), run.reason,
                  "a shorter step, a looser tolerance, or another formulation");
    }
    Trajectory answer;
    answer.response = run.response;
    answer.steps = static_cast<double>(run.work.steps);
    const auto bonds = static_cast<double>(network.driven.bonds.size());
    answer.work.add(Operation::bond_force, bonds * static_cast<double>(run.work.rates))
        .add(Operation::bond_stiffness, bonds * static_cast<double>(run.work.factorisations));
    return answer;
  }

 private:
  [[nodiscard]] static std::optional<MethodMasses> masses(const ExperimentScene& scene,
                                                          const RunNetwork& network) {
    if (!scene.formulation.masses) return std::nullopt;
    const DrivenNetwork& driven = network.driven;
    Eigen::VectorXd mass_kg = masses_kg(scene, network);
    const LowestMode lowest = lowest_mode(driven.bonds, driven.rest, driven.constraints, mass_kg);
    const double drag = 2.0 * scene.formulation.damping_ratio * lowest.angular_frequency();
    return MethodMasses{std::move(mass_kg), drag};
  }

  StepRule rule_;
};

constexpr int kFirstRank = 200;  // behind all that solve a network with care

std::vector<std::unique_ptr<const Formulation>> made_step_rules() {
  std::vector<std::unique_ptr<const Formulation>> all;
  for (const StepRuleEntry& rule : kStepRules) {
    Formulation::Entry entry;
    entry.name = rule.text;
    entry.meaning = rule.words;
    entry.can = with_any_material({.network = true,
                                   .depth = true,
                                   .load = true,
                                   .jumps = true,
                                   .masses = true,
                                   .several_contacts = true});
    entry.rank = kFirstRank + static_cast<int>(all.size());
    entry.keys = {"masses", "damping_ratio", "density_kg_per_m3"};
    if (!rule.adaptive) entry.keys.emplace_back("step");
    if (rule.meaning == StepRule::xpbd) entry.keys.emplace_back("sweeps");
    all.push_back(std::make_unique<StepRuleFormulation>(rule.meaning, std::move(entry)));
  }
  return all;
}

}  // namespace

Formulations step_rules_formulations() {
  static const std::vector<std::unique_ptr<const Formulation>> made = made_step_rules();
  static const std::vector<const Formulation*> all = [] {
    std::vector<const Formulation*> list;
    for (const auto& formulation : made) list.push_back(formulation.get());
    return list;
  }();
  return all;
}

}  // namespace tpm::plan
