// The network in balance at each instant: by collocation, and with one step a period.
#include "tpm/plan/plan_model.hpp"
#include "tpm/simulate/recorder.hpp"

namespace tpm {
namespace {

class QuasiStaticFormulation final : public Formulation,
                                     public SceneRunner,
                                     public StateRunner,
                                     public PlanOffer {
 public:
  using Formulation::Formulation;

  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                               const std::vector<double>& times_s, bool with_field) const override {
    QuasiStaticOptions options;
    options.tolerance = scene.formulation.tolerance;
    return run_quasi_static(scene, network, options, times_s, with_field);
  }

  [[nodiscard]] SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                                       const SimulationControls& controls) const override {
    const auto run_part = [&](Recorder& recorder, std::span<const double> times) {
      const PartOfProtocol part(scene, times.back());
      const DrivenNetwork& driven = network.driven;
      const QuasiStatic equations(driven.bonds, driven.rest, driven.freedom, driven.probes,
                                  {.tolerance = part.tolerance, .energies = true});
      const auto see = [&](const QuasiStaticState& state) { recorder.see(state); };
      recorder.close_part(
          equations.run(part.protocol, times, see, recorder.latest()).error_estimate);
    };
    return run_in_parts(scene, network, controls, run_part);
  }

  [[nodiscard]] PlanModels candidates(const PlanScene& scene) const override {
    return collocation_candidates(scene);
  }
};

class NetworkStepFormulation final : public Formulation, public SceneRunner, public PlanOffer {
 public:
  using Formulation::Formulation;
  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& /*network*/,
                               const std::vector<double>& times_s, bool with_field) const override {
    const PlanModels all = candidates(PlanScene(scene));
    return run_candidate_on(*all.back(), scene, times_s, with_field);
  }
  [[nodiscard]] PlanModels candidates(const PlanScene& scene) const override {
    return network_step_candidates(scene);
  }
};

constexpr Capabilities kOfNetwork{.network = true,
                                  .depth = true,
                                  .load = true,
                                  .jumps = true,
                                  .field = true,
                                  .several_contacts = true,
                                  .tools = true,
                                  .beforehand = true,
                                  .planned = true};

Capabilities in_steps(Capabilities can) {
  can.beforehand = false;
  return can;
}

}  // namespace

Formulations quasi_static_formulations() {
  static const QuasiStaticFormulation collocation(
      {"quasi_static",
       "forces balance at each instant; collocation with steps that follow an "
       "estimate of the error",
       kOfNetwork,
       170,
       {},
       "collocation"});
  static const NetworkStepFormulation step(
      {"network_step",
       "forces balance at each instant; collocation of two stages with one step a "
       "period",
       in_steps(kOfNetwork),
       160,
       {"step"}});
  static const std::vector<const Formulation*> all{&collocation, &step};
  return all;
}

}  // namespace tpm
