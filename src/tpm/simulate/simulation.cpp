#include "tpm/simulate/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "tpm/core/text.hpp"
#include "tpm/network/lowest_mode.hpp"
#include "tpm/simulate/checkpoint.hpp"

namespace tpm {
namespace {

constexpr int kWatched = 200;  // parts of the protocol's time, whatever is written

/// The times of the outputs, those of the curve, and the protocol's corners; rising.
std::vector<double> times_to_watch(const ExperimentScene& scene) {
  const Protocol& protocol = scene.protocol;
  std::vector<double> times = scene.outputs.times_s;
  const double length = protocol.end_s() - protocol.start_s();
  for (int i = 0; i < kWatched; ++i) times.push_back(protocol.start_s() + length * i / kWatched);
  for (const Knot& knot : protocol.knots()) times.push_back(knot.time_s);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

/// Keeps what a run shows, and what it needs to go on.
class Recorder {
 public:
  Recorder(const ExperimentScene& scene, const SimulationControls& controls)
      : scene_(scene),
        controls_(controls),
        identity_(checkpoint_identity(scene)),
        watch_(scene.tissue.network, scene.probe),
        times_(times_to_watch(scene)),
        written_(Clock::now()) {}

  /// The state to go on from, if there is one.
  [[nodiscard]] std::optional<QuasiStaticState> restore() {
    if (controls_.checkpoint.empty()) return std::nullopt;
    auto found = read_checkpoint(controls_.checkpoint, identity_, controls_.note);
    if (!found) return std::nullopt;
    record_ = std::move(found->record);
    watch_.restore(record_.validity);
    return std::move(found->latest);
  }

  /// The times that are not recorded yet.
  [[nodiscard]] std::span<const double> times() const {
    return std::span(times_).subspan(std::min(record_.curve.size(), times_.size()));
  }

  void see(const QuasiStaticState& state) {
    record_.curve.push_back(
        {state.time_s, state.imposed, state.response, state.energy.value_or(QuasiStaticEnergy{})});
    const std::vector<double>& wanted = scene_.outputs.times_s;
    if (std::binary_search(wanted.begin(), wanted.end(), state.time_s)) {
      record_.outputs.push_back(state);
    }
    watch_.see(state.time_s, state.position);
    record_.validity = watch_.seen();
    if (controls_.progress) controls_.progress(record_.curve.size(), times_.size());
    const bool interrupted = controls_.interrupted && controls_.interrupted();
    save(state, interrupted);
    if (interrupted) stop(state);
  }

  [[nodiscard]] SimulationRecord take() { return std::move(record_); }

 private:
  using Clock = std::chrono::steady_clock;

  void save(const QuasiStaticState& state, bool at_once) {
    if (controls_.checkpoint.empty()) return;
    const std::chrono::duration<double> since = Clock::now() - written_;
    if (!at_once && since.count() < controls_.checkpoint_every_s) return;
    write_checkpoint(controls_.checkpoint, identity_, record_, state);
    written_ = Clock::now();
  }

  [[noreturn]] void stop(const QuasiStaticState& state) const {
    throw Interrupted(fmt::format(
        "interrupted at t = {} s of {} s; {}", significant(state.time_s, 4),
        significant(scene_.protocol.end_s(), 4),
        controls_.checkpoint.empty()
            ? std::string("there is no checkpoint to go on from")
            : fmt::format("the same command goes on from {}", controls_.checkpoint.string())));
  }

  const ExperimentScene& scene_;
  const SimulationControls& controls_;
  std::string identity_;
  ValidityWatch watch_;
  std::vector<double> times_;
  Clock::time_point written_;
  SimulationRecord record_;
};

SimulationRun run_quasi_static(const ExperimentScene& scene, const RunNetwork& network,
                               const SimulationControls& controls) {
  Recorder recorder(scene, controls);
  SimulationRun result;
  const std::optional<QuasiStaticState> from = recorder.restore();
  if (from) result.resumed_at_s = from->time_s;
  const QuasiStatic equations(network.bonds, network.network.organ.position, scene.tissue.freedom(),
                              scene.probe,
                              {.tolerance = scene.formulation.tolerance, .energies = true});
  const std::vector<double> times(recorder.times().begin(), recorder.times().end());
  const QuasiStaticRun run = equations.run(
      scene.protocol, times, [&](const QuasiStaticState& state) { recorder.see(state); },
      from ? &*from : nullptr);
  result.error_estimate = run.error_estimate;
  result.record = recorder.take();
  if (!controls.checkpoint.empty()) std::filesystem::remove(controls.checkpoint);
  return result;
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
  Recorder recorder(scene, controls);
  const std::vector<double> times(recorder.times().begin(), recorder.times().end());
  SimulationRun result;
  result.lowest_frequency_Hz = equations.lowest().frequency_Hz;
  const InertialRun run = equations.run(
      scene.protocol, times, [&](const QuasiStaticState& state) { recorder.see(state); });
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
  return scene.formulation.inertial ? run_inertial(scene, network, controls)
                                    : run_quasi_static(scene, network, controls);
}

}  // namespace tpm
