#include "tpm/simulate/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/network/lowest_mode.hpp"
#include "tpm/simulate/recorder.hpp"
#include "tpm/simulate/static_path.hpp"

namespace tpm {
namespace {

// A static run takes some factorisations at each stride: it iterates earlier than a quasi-static
// one, which shares a factorisation between many solutions.
constexpr double kStaticOperations = 2e11;

/// A network with the contacts of a scene; tools in their order.
DrivenNetwork with_contacts(const ExperimentScene& scene, const BondSystem& bonds) {
  const Organ& organ = scene.tissue.network.organ;
  // With mass, contacts ring unless they are much stiffer; a stiffer one costs no more steps there.
  constexpr double kStifferWithMass = 100.0;
  const double usual = usual_contact_stiffness_N_per_m(bonds) *
                       (scene.formulation.inertial() ? kStifferWithMass : 1.0);
  std::vector<Probe> driven;
  std::vector<PressedTool> tools;
  for (const SceneContact& contact : scene.contacts) {
    const Probe& probe = contact.probe;
    if (contact.is_tool()) {
      const ToolKind kind = contact.kind == ContactKind::ball ? ToolKind::sphere : ToolKind::punch;
      tools.push_back(
          {touching_tool({kind, contact.radius_m}, organ, probe.sphere, probe.direction),
           probe.share, contact.stiffness_N_per_m.value_or(usual)});
      continue;
    }
    for (const std::size_t sphere : spheres_of(contact, organ)) {
      driven.push_back({sphere, probe.direction, probe.share});
    }
  }
  return driven_network(bonds, organ, scene.tissue.freedom(), std::move(driven), std::move(tools));
}

/// Runs that go part by part. `run_part` shows the recorder the states at some times, and closes
/// the part.
template <class RunPart>
SimulationRun run_in_parts(const ExperimentScene& scene, const RunNetwork& network,
                           const SimulationControls& controls, RunPart&& run_part,
                           std::size_t parts = kRunParts) {
  Recorder recorder(scene, network, controls, parts);
  SimulationRun result;
  if (recorder.restore()) result.resumed_at_s = recorder.latest()->time_s;
  for (auto times = recorder.next_part(); !times.empty(); times = recorder.next_part()) {
    run_part(recorder, times);
  }
  result.record = recorder.take();
  return result;
}

/// The protocol up to the end of a part, and the tolerance there: that of the scene is one of the
/// whole, and a part of a ramp has a lower peak.
struct PartOfProtocol {
  PartOfProtocol(const ExperimentScene& scene, double end_s)
      : protocol(history_until(scene.protocol, end_s)), tolerance(scene.formulation.tolerance) {
    if (protocol.peak() > 0.0) tolerance *= scene.protocol.peak() / protocol.peak();
    tolerance = std::min(tolerance, 0.1);
  }
  Protocol protocol;
  double tolerance;
};

/// Every part of a quasi-static run begins with some factorisations: there are as many parts as
/// these are cheap, but a long protocol is cut.
std::size_t parts_of(const ExperimentScene& scene, const RunNetwork& network) {
  constexpr double kRestart = 3.0;         // factorisations
  constexpr double kAllRestarts = 2.5e9;   // operations
  constexpr std::size_t kPiecesAPart = 8;  // of the protocol
  const std::size_t least = std::min(scene.protocol.knots().size() / kPiecesAPart + 1, kRunParts);
  const SolverChoice factor = choose_solver(network.driven.bonds, network.driven.freedom,
                                            {.solver = scene.formulation.solver});
  if (!factor.direct) return kRunParts;
  const double cheap = kAllRestarts / (kRestart * factor.operations + 1.0);
  return std::clamp(cheap < kRunParts ? static_cast<std::size_t>(cheap) : kRunParts, least, kRunParts);
}

SimulationRun run_quasi_static(const ExperimentScene& scene, const RunNetwork& network,
                               const SimulationControls& controls) {
  std::optional<SolverChoice> solver;
  const auto run_part = [&](Recorder& recorder, std::span<const double> times) {
    const PartOfProtocol part(scene, times.back());
    const DrivenNetwork& driven = network.driven;
    const QuasiStatic equations(driven.bonds, driven.rest, driven.freedom, driven.probes,
                                {.tolerance = part.tolerance,
                                 .energies = true,
                                 .equilibrium = {.solver = scene.formulation.solver}});
    const auto see = [&](const QuasiStaticState& state) { recorder.see(state); };
    const QuasiStaticRun run = equations.run(part.protocol, times, see, recorder.latest());
    solver = run.solver;
    recorder.close_part(run.error_estimate);
  };
  SimulationRun result = run_in_parts(scene, network, controls, run_part, parts_of(scene, network));
  result.solver = solver;
  return result;
}

SimulationRun run_static(const ExperimentScene& scene, const RunNetwork& network,
                         const SimulationControls& controls) {
  const DrivenNetwork& driven = network.driven;
  StaticPath path(driven.bonds, driven.rest, network.network.organ.spacing, driven.freedom,
                  driven.probes, scene.protocol.drive(), scene.protocol.peak(),
                  scene.formulation.tolerance,
                  {.solver = scene.formulation.solver, .most_operations = kStaticOperations});
  const auto run_part = [&](Recorder& recorder, std::span<const double> times) {
    if (recorder.latest()) path.start_from(*recorder.latest());
    for (const double time : times) {
      recorder.see(path.move_to(value_at(scene.protocol, time), time));
    }
    recorder.close_part(0.0);
  };
  SimulationRun result = run_in_parts(scene, network, controls, run_part);
  result.solver = path.solver();
  return result;
}

/// kg, of spheres and tools.
Eigen::VectorXd masses_kg(const ExperimentScene& scene, const RunNetwork& network) {
  const Organ& organ = network.network.organ;
  Eigen::VectorXd mass(network.driven.rest.cols());
  mass.head(organ.position.cols()) = sphere_masses_kg(organ, scene.formulation.density_kg_m3);
  Eigen::Index column = organ.position.cols();
  for (const SceneContact& contact : scene.contacts) {
    if (contact.is_tool()) mass[column++] = contact.mass_kg.value();
  }
  return mass;
}

SimulationRun run_with_mass(const ExperimentScene& scene, const RunNetwork& network,
                            const SimulationControls& controls) {
  const DrivenNetwork& driven = network.driven;
  const Eigen::VectorXd mass_kg = masses_kg(scene, network);
  InertialOptions options;
  options.damping_ratio = scene.formulation.damping_ratio;
  // The mass-spring model has a damper beside each spring.
  options.stiffness_share = scene.formulation.mass_spring ? 1.0 : 0.0;
  options.energy = true;
  const auto run_part = [&](Recorder& recorder, std::span<const double> times) {
    const PartOfProtocol part(scene, times.back());
    options.tolerance = part.tolerance;
    const Inertial equations(driven.bonds, driven.rest, driven.freedom, driven.probes, mass_kg,
                             options);
    const auto see = [&](const QuasiStaticState& state, const Eigen::VectorXd& pushes) {
      recorder.see(state, pushes);
    };
    const InertialRun run = equations.run(part.protocol, times, see, recorder.motion());
    recorder.close_part(run.end, run.energy.value(), run.blows);
  };
  SimulationRun result = run_in_parts(scene, network, controls, run_part);
  result.lowest_frequency_Hz =
      lowest_mode(driven.bonds, driven.rest, driven.freedom, mass_kg).frequency_Hz;
  return result;
}

/// Runs the scene with softer contacts and compares.
ContactCheck checked_contacts(const ExperimentScene& scene, const RunNetwork& network,
                              const std::vector<CurvePoint>& curve,
                              const SimulationControls& controls) {
  ExperimentScene softer = scene;
  auto tool = network.driven.tools.begin();
  for (SceneContact& contact : softer.contacts) {
    if (!contact.is_tool()) continue;
    contact.stiffness_N_per_m = (tool++)->stiffness_N_per_m / ContactCheck::kSofter;
  }
  SimulationControls quiet;
  quiet.interrupted = controls.interrupted;
  const std::vector<CurvePoint> other =
      run_with_mass(softer, network_to_run(softer), quiet).record.curve;
  ContactCheck check;
  double over_time = 0.0, before = 0.0;  // trapezoidal rule
  for (std::size_t i = 0; i < curve.size(); ++i) {
    check.largest = std::max(check.largest, std::abs(curve[i].response));
    check.largest_softer = std::max(check.largest_softer, std::abs(other[i].response));
    const double apart = std::abs(curve[i].response - other[i].response);
    check.at_one_time = std::max(check.at_one_time, apart);
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

SimulationRun run_inertial(const ExperimentScene& scene, const RunNetwork& network,
                           const SimulationControls& controls) {
  SimulationRun result = run_with_mass(scene, network, controls);
  if (!network.driven.tools.empty()) {
    result.contact_check = checked_contacts(scene, network, result.record.curve, controls);
  }
  return result;
}

}  // namespace

RunNetwork network_to_run(const ExperimentScene& scene) {
  const Tissue& tissue = scene.tissue;
  if (!scene.formulation.mass_spring) {
    return {tissue.network, with_contacts(scene, tissue.bonds())};
  }
  const Freedom freedom = tissue.freedom();
  const double stiffness = contact_stiffness_N_per_m(tissue.bonds(), tissue.network.organ.position,
                                                     freedom, scene.probe(), 1.0);
  Network msm = msm_network(tissue.network, scene.formulation.springs);
  const BondMaterial springs = msm_material(msm, freedom, scene.probe(), stiffness);
  DrivenNetwork driven = with_contacts(scene, BondSystem(msm, springs));
  return {std::move(msm), std::move(driven)};
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
