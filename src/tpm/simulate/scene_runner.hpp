#pragma once
// What a formulation does for scenes: two of its roles (formulation/formulation.hpp).
#include "tpm/simulate/operation_count.hpp"
#include "tpm/simulate/simulation.hpp"

namespace tpm {

/// How a scene answers over its protocol.
struct Trajectory {
  Eigen::VectorXd response;                    ///< N or m, at each time
  std::vector<Eigen::Matrix3Xd> displacement;  ///< of all spheres, m, at each time; if asked for
  Validity validity;  ///< of networks without masses: limits passed at the times asked for
  OperationCount work;
  double steps = 0.0;
  double error_estimate = 0.0;  ///< the formulation's own, N or m; 0 where it has none
};

/// Answers scenes at given times.
class SceneRunner {
 public:
  SceneRunner() = default;
  SceneRunner(const SceneRunner&) = delete;
  SceneRunner& operator=(const SceneRunner&) = delete;
  virtual ~SceneRunner() = default;

  /// @param scene one that the formulation can run (require_runnable)
  /// @param network network_to_run(scene)
  /// @param times_s rising, within the protocol
  /// @param with_field fill Trajectory::displacement; only of formulations with that capability
  /// Throws Error(numerical) where the formulation fails, Error(bad_input) for what its
  /// capabilities do not say.
  [[nodiscard]] virtual Trajectory run(const ExperimentScene& scene, const RunNetwork& network,
                                       const std::vector<double>& times_s,
                                       bool with_field) const = 0;
};

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
/// The network with masses.
[[nodiscard]] Trajectory run_inertial(const ExperimentScene& scene, const RunNetwork& network,
                                      const InertialOptions& options,
                                      const std::vector<double>& times_s, bool with_field);

/// Throws Error(bad_input), with the scene's place and the formulations that would do, unless the
/// scene's formulation can run it.
void require_runnable(const ExperimentScene& scene);

/// Runs a scene by its formulation. Throws as require_runnable() and SceneRunner::run() do.
/// @param times_s rising, within the protocol
[[nodiscard]] Trajectory run_scene(const ExperimentScene& scene, const std::vector<double>& times_s,
                                   bool with_field);

}  // namespace tpm
