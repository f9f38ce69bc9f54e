// The network in balance at each instant: by collocation, and with one step a period.
#include <algorithm>

#include "tpm/organ/run/recorder.hpp"
#include "tpm/plan/plan_model.hpp"

namespace tpm::plan {
namespace {

/// Every part of a quasi-static run begins with some factorisations and ends a step of time: a run
/// is halved where these are cheap. A long protocol is cut into more.
std::size_t parts_of(const ExperimentScene& scene, const RunNetwork& network) {
  constexpr double kRestart = 3.0;         // factorisations
  constexpr double kMostRestart = 1.25e9;  // operations
  constexpr std::size_t kPiecesAPart = 8;  // of the protocol
  const std::size_t least = std::min(scene.protocol.knots().size() / kPiecesAPart + 1, kRunParts);
  const SolverChoice factor = choose_solver(network.driven.bonds, network.driven.constraints,
                                            {.solver = scene.formulation.solver});
  if (!factor.direct) return kRunParts;
  return std::max<std::size_t>(least, kRestart * factor.operations < kMostRestart ? 2 : 1);
}

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
    options.equilibrium.solver = scene.formulation.solver;
    return run_quasi_static(scene, network, options, times_s, with_field);
  }

  [[nodiscard]] SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                                       const SimulationControls& controls) const override {
    std::optional<SolverChoice> solver;
    const auto run_part = [&](Recorder& recorder, std::span<const double> times) {
      const PartOfProtocol part(scene, times.back());
      const DrivenNetwork& driven = network.driven;
      const QuasiStatic equations(driven.bonds, driven.rest, driven.constraints, driven.probes,
                                  {.tolerance = part.tolerance,
                                   .energies = true,
                                   .extremes = true,
                                   .equilibrium = {.solver = scene.formulation.solver}});
      const auto see = [&](const QuasiStaticState& state) { recorder.see(state); };
      const QuasiStaticRun run = equations.run(part.protocol, times, see, recorder.latest());
      solver = run.solver;
      recorder.close_part(run.error_estimate);
    };
    SimulationRun result =
        run_in_parts(scene, network, controls, run_part, parts_of(scene, network));
    result.solver = solver;
    return result;
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

constexpr Capabilities kOfNetwork = with_any_material({.network = true,
                                                       .depth = true,
                                                       .load = true,
                                                       .jumps = true,
                                                       .field = true,
                                                       .several_contacts = true,
                                                       .tools = true,
                                                       .own_protocols = true,
                                                       .dead_loads = true,
                                                       .beforehand = true,
                                                       .planned = true});

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
       {"solver"},
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

}  // namespace tpm::plan
