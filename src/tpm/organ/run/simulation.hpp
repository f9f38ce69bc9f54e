#pragma once
#include <functional>
#include <optional>

#include "tpm/organ/balance/driven_network.hpp"
#include "tpm/organ/balance/inertial.hpp"
#include "tpm/organ/run/validity.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/work/interrupted.hpp"

namespace tpm::organ {

/// The network that is run: the tissue, or the mass-spring model that takes its place, with what
/// touches it.
struct RunNetwork {
  Network network;  ///< without tools
  DrivenNetwork driven;

  /// The spheres of positions that tools follow.
  [[nodiscard]] Positions spheres(const Positions& position) const {
    return position.leftCols(network.organ.position.cols());
  }
};

/// The mass-spring model is matched to the tissue's equilibrium stiffness under the probe.
/// Throws as msm_material does.
[[nodiscard]] RunNetwork network_to_run(const ExperimentScene& scene);

/// kg, of spheres and tools. Throws Error(bad_input) for a tool without mass.
/// @param of_imposed_kg of tools without mass whose depth is imposed
[[nodiscard]] Eigen::VectorXd masses_kg(const ExperimentScene& scene, const RunNetwork& network,
                                        std::optional<double> of_imposed_kg = std::nullopt);

/// A point of the response. The history is watched finely enough to be drawn and to date what
/// passes a limit, whatever is written; extremes between the watched times are points as well.
struct CurvePoint {
  double time_s = 0.0;
  double imposed = 0.0;             ///< depth, m, or load, N
  double response = 0.0;            ///< contact force, N, or depth, m
  QuasiStaticEnergy energy;         ///< of a quasi-static run
  int touching = 0;                 ///< spheres that tools touch
  double overlap_m = 0.0;           ///< the largest of their contacts
  double force_on_tissue_N = 0.0;   ///< force_on_tissue_N()
  std::vector<double> beside = {};  ///< responses of contacts with protocols of their own, in turn
  bool between = false;             ///< an extreme between the watched times
  bool settling = false;            ///< a contact has just been struck (QuasiStaticState)
};

/// True if a point counts for the largest response: the force of a contact that settles after an
/// impact depends on the contact's stiffness, which is none of the tissue.
[[nodiscard]] inline bool counts(const CurvePoint& point) {
  return !point.settling;
}

/// The first point of the largest response; responses that differ by less than the tolerance are
/// the same. The end always counts.
/// @param curve not empty
/// @param tolerance relative
[[nodiscard]] const CurvePoint& largest_point(const std::vector<CurvePoint>& curve,
                                              double tolerance);

/// Parts of a run; each begins afresh, and a checkpoint can be written after it.
inline constexpr std::size_t kRunParts = 16;

/// Results of a run so far, rising in time.
struct SimulationRecord {
  std::vector<CurvePoint> curve;
  std::vector<QuasiStaticState> outputs;  ///< at the times of the scene's outputs
  /// Of each output what contacts push with, N, where bodies have mass; empty: overlaps say it.
  std::vector<Eigen::VectorXd> contact_pushes_N;
  Validity validity;
  double error_estimate = 0.0;  ///< quasi-static: sum of the steps' error estimates, N or m
  std::optional<InertialEnergy> inertial_energy;
  std::vector<ProbeImpact> impacts;  ///< where spheres have mass
};

/// Effect of the stiffness of contacts: a run with mass against one whose contacts are softer.
/// The stiffness of a contact is none of the tissue; a number that depends on it is no answer.
struct ContactCheck {
  static constexpr double kSofter = 4.0;      ///< times softer the contacts of the other run are
  static constexpr double kTolerable = 0.01;  ///< larger differences are warned of

  double largest = 0.0, largest_softer = 0.0;  ///< responses, N or m
  double end = 0.0, end_softer = 0.0;          ///< responses at the end
  /// In parts of the largest response: the largest of the differences of largest, of end, and of
  /// the curves in the mean over time.
  double difference = 0.0;
  /// The same of the curves at one time: a tool that bounces leaves at another instant.
  double at_one_time = 0.0;

  [[nodiscard]] bool depends_on_stiffness() const { return !(difference <= kTolerable); }
};

/// Observers of a run. Nothing of it changes what it finds.
struct SimulationControls {
  std::function<void(std::size_t done, std::size_t total)> progress;  ///< of the points watched
  std::function<bool()> interrupted;                                  ///< asked at each point
  std::filesystem::path checkpoint;                                   ///< none if empty
  double checkpoint_every_s = 5.0;               ///< of the clock on the wall, >= 0
  std::function<void(const std::string&)> note;  ///< told why a checkpoint is not used
};

struct SimulationRun {
  SimulationRecord record;
  std::optional<double> resumed_at_s;         ///< time of the checkpoint it went on from
  double lowest_frequency_Hz = 0.0;           ///< of an inertial run, of the tissue without tools
  std::optional<ContactCheck> contact_check;  ///< of an inertial run with tools
  std::optional<SolverChoice> solver;  ///< of a run without mass; none if a checkpoint held it all
};

/// Runs a scene by its formulation, which has to show whole states (StateRunner). A run with mass
/// and tools is run again with softer contacts (ContactCheck). A run writes a checkpoint now and
/// then and goes on from one that an earlier run of the same scene and version has left, with the
/// same result to the bit; the file is left for the caller to remove once the result is safe.
/// Throws Error(bad_input) as require_runnable() does, Error(numerical) as the formulations do,
/// Interrupted, Error(environment) where a checkpoint cannot be written, Error(bad_input) for a
/// damaged checkpoint.
[[nodiscard]] SimulationRun simulate(const ExperimentScene& scene, const RunNetwork& network,
                                     const SimulationControls& controls = {});

}  // namespace tpm::organ
