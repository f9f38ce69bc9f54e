#include "tpm/simulate/simulation.hpp"

#include <algorithm>

#include "tpm/network/lowest_mode.hpp"
#include "tpm/simulate/recorder.hpp"
#include "tpm/simulate/static_path.hpp"

namespace tpm {
namespace {

constexpr std::size_t kParts = 16;  // of a run; a checkpoint can be written after each

/// Runs that go part by part; `run_part` shows the recorder the states at the times of one.
template <class RunPart>
SimulationRun run_in_parts(const ExperimentScene& scene, const SimulationControls& controls,
                           RunPart&& run_part) {
  Recorder recorder(scene, controls, kParts);
  SimulationRun result;
  std::optional<QuasiStaticState> from = recorder.restore();
  if (from) result.resumed_at_s = from->time_s;
  for (auto times = recorder.next_part(); !times.empty(); times = recorder.next_part()) {
    recorder.close_part(run_part(recorder, times, from));
    from = recorder.latest();
  }
  result.record = recorder.take();
  return result;
}

SimulationRun run_quasi_static(const ExperimentScene& scene, const RunNetwork& network,
                               const SimulationControls& controls) {
  const double peak = scene.protocol.peak();
  const auto run_part = [&](Recorder& recorder, std::span<const double> times,
                            const std::optional<QuasiStaticState>& from) {
    const Protocol part = history_until(scene.protocol, times.back());
    // The tolerance is one of the whole: a part of a ramp has a lower peak.
    const double share = part.peak() > 0.0 ? peak / part.peak() : 1.0;
    const QuasiStaticOptions options{
        .tolerance = std::min(share * scene.formulation.tolerance, 0.1), .energies = true};
    const QuasiStatic equations(network.bonds, network.network.organ.position,
                                scene.tissue.freedom(), scene.probe, options);
    const auto see = [&](const QuasiStaticState& state) { recorder.see(state); };
    return equations.run(part, times, see, from ? &*from : nullptr).error_estimate;
  };
  return run_in_parts(scene, controls, run_part);
}

SimulationRun run_static(const ExperimentScene& scene, const RunNetwork& network,
                         const SimulationControls& controls) {
  StaticPath path(network.bonds, network.network.organ, scene.tissue.freedom(), scene.probe,
                  scene.protocol.drive(), scene.protocol.peak(), scene.formulation.tolerance);
  const auto run_part = [&](Recorder& recorder, std::span<const double> times,
                            const std::optional<QuasiStaticState>& from) {
    if (from) path.start_from(*from);
    for (const double time : times) {
      recorder.see(path.move_to(value_at(scene.protocol, time), time));
    }
    return 0.0;
  };
  return run_in_parts(scene, controls, run_part);
}

SimulationRun run_inertial(const ExperimentScene& scene, const RunNetwork& network,
                           SimulationControls controls) {
  controls.checkpoint.clear();
  InertialOptions options;
  options.tolerance = scene.formulation.tolerance;
  options.damping_ratio = scene.formulation.damping_ratio;
  // The mass-spring model has a damper beside each spring.
  options.stiffness_share = scene.formulation.mass_spring ? 1.0 : 0.0;
  options.energy = true;
  const Organ& organ = network.network.organ;
  const Inertial equations(network.bonds, organ.position, scene.tissue.freedom(), scene.probe,
                           sphere_masses_kg(organ, scene.formulation.density_kg_m3), options);
  SimulationRun result;
  result.lowest_frequency_Hz = equations.lowest().frequency_Hz;
  Recorder recorder(scene, controls, 1);
  const InertialRun run =
      equations.run(scene.protocol, recorder.next_part(),
                    [&](const QuasiStaticState& state) { recorder.see(state); });
  result.inertial_energy = run.energy;
  result.record = recorder.take();
  return result;
}

}  // namespace

RunNetwork network_to_run(const ExperimentScene& scene) {
  const Tissue& tissue = scene.tissue;
  if (!scene.formulation.mass_spring) return {tissue.network, tissue.material, tissue.bonds()};
  const Freedom freedom = tissue.freedom();
  const double stiffness = contact_stiffness_N_per_m(tissue.bonds(), tissue.network.organ.position,
                                                     freedom, scene.probe, 1.0);
  Network msm = msm_network(tissue.network, scene.formulation.springs);
  const TpmParameters material =
      msm_material(msm, tissue.material, freedom, scene.probe, stiffness);
  BondSystem bonds(msm, material);
  return {std::move(msm), material, std::move(bonds)};
}

SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                       const SimulationControls& controls) {
  switch (scene.formulation.kind) {
    case FormulationKind::inertial:
      return run_inertial(scene, network, controls);
    case FormulationKind::relaxed:
      return run_static(scene, network, controls);
    case FormulationKind::quasi_static:
      break;
  }
  return run_quasi_static(scene, network, controls);
}

}  // namespace tpm
