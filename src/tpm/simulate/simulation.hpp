#pragma once
#include <functional>
#include <stdexcept>

#include "tpm/network/driven_network.hpp"
#include "tpm/network/inertial.hpp"
#include "tpm/scene/experiment_scene.hpp"
#include "tpm/simulate/validity.hpp"

namespace tpm {

/// The network that is run: the tissue, or the mass-spring model that takes its place, with what
/// touches it.
struct RunNetwork {
  Network network;  ///< without tools
  TpmParameters material;
  DrivenNetwork driven;

  /// The spheres of positions that tools follow.
  [[nodiscard]] Positions spheres(const Positions& position) const {
    return position.leftCols(network.organ.position.cols());
  }
};

/// The mass-spring model is matched to the tissue's relaxed stiffness under the probe.
/// Throws as msm_material does.
[[nodiscard]] RunNetwork network_to_run(const ExperimentScene& scene);

/// kg, of spheres and tools. Throws Error(bad_input) for a tool without mass.
[[nodiscard]] Eigen::VectorXd masses_kg(const ExperimentScene& scene, const RunNetwork& network);

/// A point of the response. The same history is watched whatever is written: it is fine enough to
/// be drawn, and dates what passes a limit.
struct CurvePoint {
  double time_s = 0.0;
  double imposed = 0.0;      ///< depth, m, or load, N
  double response = 0.0;     ///< contact force, N, or depth, m
  QuasiStaticEnergy energy;  ///< of a quasi-static run
  int touching = 0;          ///< spheres that tools touch
  double overlap_m = 0.0;    ///< the largest of their contacts
};

/// What a run has found so far, rising in time.
struct SimulationRecord {
  std::vector<CurvePoint> curve;
  std::vector<QuasiStaticState> outputs;  ///< at the times of the scene's outputs
  Validity validity;
  double error_estimate = 0.0;  ///< quasi-static: sum of the steps' error estimates, N or m
  std::optional<InertialEnergy> inertial_energy;
};

/// How a run is accompanied. Nothing of it changes what it finds.
struct SimulationControls {
  std::function<void(std::size_t done, std::size_t total)> progress;  ///< of the points watched
  std::function<bool()> interrupted;                                  ///< asked at each point
  std::filesystem::path checkpoint;                                   ///< none if empty
  double checkpoint_every_s = 5.0;               ///< of the clock on the wall, >= 0
  std::function<void(const std::string&)> note;  ///< told why a checkpoint is not used
};

struct SimulationRun {
  SimulationRecord record;
  std::optional<double> resumed_at_s;  ///< time of the checkpoint it went on from
  double lowest_frequency_Hz = 0.0;    ///< of an inertial run
};

/// A run that was asked to stop; says where it stands.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs a scene by its formulation, which has to show whole states (StateRunner). A run
/// writes a checkpoint now and then and goes on from one that an earlier run of the same scene and
/// version has left, with the same result to the bit; the file is left for the caller to remove
/// once the result is safe.
/// Throws Error(bad_input) as require_runnable() does, Error(numerical) as the formulations do,
/// Interrupted, Error(environment) where a checkpoint cannot be written, Error(bad_input) for a
/// damaged checkpoint.
[[nodiscard]] SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                                     const SimulationControls& controls = {});

}  // namespace tpm
