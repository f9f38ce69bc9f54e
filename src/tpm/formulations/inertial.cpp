// Spheres with mass, under CVODES.
#include "tpm/network/lowest_mode.hpp"
#include "tpm/plan/plan_model.hpp"
#include "tpm/simulate/recorder.hpp"

namespace tpm {
namespace {

class InertialFormulation final : public Formulation,
                                  public SceneRunner,
                                  public StateRunner,
                                  public PlanOffer {
 public:
  using Formulation::Formulation;

  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                               const std::vector<double>& times_s, bool with_field) const override {
    return run_inertial(scene, network, options_of(scene), times_s, with_field);
  }

  [[nodiscard]] SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                                       const SimulationControls& controls) const override {
    const DrivenNetwork& driven = network.driven;
    const Eigen::VectorXd mass_kg = masses_kg(scene, network);
    InertialOptions options = options_of(scene);
    options.energy = true;
    const auto run_part = [&](Recorder& recorder, std::span<const double> times) {
      const PartOfProtocol part(scene, times.back());
      options.tolerance = part.tolerance;
      const Inertial equations(driven.bonds, driven.rest, driven.freedom, driven.probes, mass_kg,
                               options);
      const auto see = [&](const QuasiStaticState& state) { recorder.see(state); };
      const InertialRun run = equations.run(part.protocol, times, see, recorder.motion());
      recorder.close_part(run.end, run.energy.value());
    };
    SimulationRun result = run_in_parts(scene, network, controls, run_part);
    result.lowest_frequency_Hz =
        lowest_mode(driven.bonds, driven.rest, driven.freedom, mass_kg).frequency_Hz;
    return result;
  }

  [[nodiscard]] PlanModels candidates(const PlanScene& /*scene*/) const override {
    return inertial_candidates();
  }

 private:
  [[nodiscard]] static InertialOptions options_of(const ExperimentScene& scene) {
    InertialOptions options;
    options.tolerance = scene.formulation.tolerance;
    options.damping_ratio = scene.formulation.damping_ratio;
    // The mass-spring model has a damper beside each spring.
    options.stiffness_share = scene.formulation.mass_spring ? 1.0 : 0.0;
    return options;
  }
};

}  // namespace

Formulations inertial_formulations() {
  static const InertialFormulation inertial(
      {"inertial",
       "spheres have mass; equations of motion integrated by CVODES (BDF)",
       {.network = true,
        .depth = true,
        .load = true,
        .jumps = true,
        .field = true,
        .masses = true,
        .several_contacts = true,
        .tools = true,
        .planned = true},
       180,
       {"damping_ratio", "density_kg_per_m3"}});
  static const std::vector<const Formulation*> all{&inertial};
  return all;
}

}  // namespace tpm
