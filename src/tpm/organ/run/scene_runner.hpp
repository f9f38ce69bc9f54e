#pragma once
// Two roles of a formulation that concern scenes (formulation/formulation.hpp).
#include <functional>

#include "tpm/organ/run/simulation.hpp"
#include "tpmkit/simulation.hpp"

namespace tpm::organ {

/// Shows whole states of the network, and goes on from checkpoints.
class StateRunner {
 public:
  StateRunner() = default;
  StateRunner(const StateRunner&) = delete;
  StateRunner& operator=(const StateRunner&) = delete;
  virtual ~StateRunner() = default;
  /// simulate() by this formulation.
  [[nodiscard]] virtual SimulationRun simulate(const ExperimentScene& scene,
                                               const RunNetwork& network,
                                               const SimulationControls& controls) const = 0;
};

/// The network of a scene without masses, by collocation. Throws Error(numerical) as QuasiStatic
/// does.
[[nodiscard]] Trajectory run_quasi_static(const ExperimentScene& scene, const RunNetwork& network,
                                          const QuasiStaticOptions& options,
                                          const std::vector<double>& times_s, bool with_field);
/// Operations of one Newton iteration for an equilibrium: forces, a factorisation, a solution.
[[nodiscard]] OperationCount newton_iteration_work(const DrivenNetwork& driven);
/// Those of a run by collocation.
[[nodiscard]] OperationCount counted_work(const DrivenNetwork& driven, const QuasiStaticWork& work);
/// The network with masses.
/// @param reached told each time of `times_s` that the run has come to, s
[[nodiscard]] Trajectory run_inertial(const ExperimentScene& scene, const RunNetwork& network,
                                      const InertialOptions& options,
                                      const std::vector<double>& times_s, bool with_field,
                                      const std::function<void(double)>& reached = {});

/// Throws Error(bad_input), with the scene's place and the formulations that would do, unless the
/// scene's formulation can run it.
void require_runnable(const ExperimentScene& scene);

/// Runs a scene by its formulation. Throws as require_runnable() and SceneRunner::run() do.
/// @param times_s rising, within the protocol
[[nodiscard]] Trajectory run_scene(const ExperimentScene& scene, const std::vector<double>& times_s,
                                   bool with_field);

}  // namespace tpm::organ
