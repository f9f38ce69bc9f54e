// Spheres with mass, under CVODES.
#include <algorithm>
#include <cmath>

#include "tpm/organ/bonds/lowest_mode.hpp"
#include "tpm/organ/run/recorder.hpp"
#include "tpm/plan/plan_model.hpp"

namespace tpm::plan {
namespace {

InertialOptions options_with_mass(const ExperimentScene& scene) {
  InertialOptions options;
  options.tolerance = scene.formulation.tolerance;
  options.damping_ratio = scene.formulation.damping_ratio;
  // The mass-spring model has a damper beside each spring.
  options.stiffness_share = scene.formulation.mass_spring ? 1.0 : 0.0;
  return options;
}

SimulationRun run_with_mass(const ExperimentScene& scene, const RunNetwork& network,
                            const SimulationControls& controls) {
  const DrivenNetwork& driven = network.driven;
  const Eigen::VectorXd mass_kg = masses_kg(scene, network);
  InertialOptions options = options_with_mass(scene);
  options.energy = true;
  const auto run_part = [&](Recorder& recorder, std::span<const double> times) {
    const PartOfProtocol part(scene, times.back());
    options.tolerance = part.tolerance;
    const Inertial equations(driven.bonds, driven.rest, driven.constraints, driven.probes, mass_kg,
                             options);
    const auto see = [&](const QuasiStaticState& state, const Eigen::VectorXd& pushes) {
      recorder.see(state, pushes);
    };
    const StepObserver steps{[&](const QuasiStaticState& state, const Eigen::VectorXd& pushes) {
                               recorder.follow(state, pushes);
                             },
                             [&] { recorder.corner(); }};
    const InertialRun run = equations.run(part.protocol, times, see, recorder.motion(), steps);
    recorder.close_part(run.end, run.energy.value(), run.impacts);
  };
  SimulationRun result = run_in_parts(scene, network, controls, run_part);
  const Positions& unloaded = driven.probes.loading().unloaded;
  result.lowest_frequency_Hz =
      lowest_mode(driven.bonds, unloaded.size() > 0 ? unloaded : driven.rest, driven.constraints,
                  mass_kg)
          .frequency_Hz;
  return result;
}

double largest_response(const std::vector<CurvePoint>& curve) {
  return std::abs(largest_point(curve, 0.0).response);
}

/// Runs the scene with softer contacts and compares.
ContactCheck checked_contacts(const ExperimentScene& scene, const RunNetwork& network,
                              std::vector<CurvePoint> curve, const SimulationControls& controls) {
  ExperimentScene softer = scene;
  auto tool = network.driven.tools.begin();
  for (SceneContact& contact : softer.contacts) {
    if (!contact.is_tool()) continue;
    contact.stiffness_N_per_m = (tool++)->stiffness_N_per_m / ContactCheck::kSofter;
  }
  SimulationControls quiet;
  quiet.interrupted = controls.interrupted;
  std::vector<CurvePoint> other = run_with_mass(softer, network_to_run(softer), quiet).record.curve;
  ContactCheck check;
  check.largest = largest_response(curve);
  check.largest_softer = largest_response(other);
  const auto between = [](const CurvePoint& p) { return p.between; };
  std::erase_if(curve, between);  // either curve has its own
  std::erase_if(other, between);
  double over_time = 0.0, before = 0.0;  // trapezoidal rule
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double apart = std::abs(curve[i].response - other[i].response);
    if (counts(curve[i]) && counts(other[i])) {
      check.at_one_time = std::max(check.at_one_time, apart);
    }
    if (i > 0) over_time += 0.5 * (apart + before) * (curve[i].time_s - curve[i - 1].time_s);
    before = apart;
  }
  check.end = curve.back().response;
  check.end_softer = other.back().response;
  if (!(check.largest > 0.0)) return check;
  check.difference = std::max({std::abs(check.largest - check.largest_softer),
                               std::abs(check.end - check.end_softer),
                               over_time / (curve.back().time_s - curve.front().time_s)}) /
                     check.largest;
  check.at_one_time /= check.largest;
  return check;
}

class InertialFormulation final : public Formulation,
                                  public SceneRunner,
                                  public StateRunner,
                                  public PlanOffer {
 public:
  using Formulation::Formulation;

  [[nodiscard]] Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                               const std::vector<double>& times_s, bool with_field) const override {
    return run_inertial(scene, network, options_with_mass(scene), times_s, with_field);
  }

  [[nodiscard]] SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                                       const SimulationControls& controls) const override {
    SimulationRun result = run_with_mass(scene, network, controls);
    if (!network.driven.tools.empty()) {
      result.contact_check = checked_contacts(scene, network, result.record.curve, controls);
    }
    return result;
  }

  [[nodiscard]] PlanModels candidates(const PlanScene& /*scene*/) const override {
    return inertial_candidates();
  }
};

}  // namespace

Formulations inertial_formulations() {
  static const InertialFormulation inertial(
      {"inertial",
       "spheres have mass; equations of motion integrated by CVODES (BDF)",
       with_any_material({.network = true,
                          .depth = true,
                          .load = true,
                          .jumps = true,
                          .field = true,
                          .masses = true,
                          .several_contacts = true,
                          .tools = true,
                          .own_protocols = true,
                          .dead_loads = true,
                          .planned = true}),
       180,
       {"damping_ratio", "density_kg_per_m3"}});
  static const std::vector<const Formulation*> all{&inertial};
  return all;
}

}  // namespace tpm::plan
