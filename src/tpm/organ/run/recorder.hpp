#pragma once
#include <chrono>
#include <span>

#include "tpm/organ/run/curve_extremes.hpp"
#include "tpm/organ/run/simulation.hpp"

namespace tpm::organ {

/// The times at which a run is watched: those of the outputs, 200 even parts of the protocol, and
/// the corners of every contact's protocol; rising.
[[nodiscard]] std::vector<double> times_to_watch(const ExperimentScene& scene);

/// Keeps what a run shows. The watched times are cut into parts; at the end of a part the run
/// starts afresh from the state there, interrupted or not, so that a run that goes on from a
/// checkpoint computes what one that was never stopped computes, to the bit.
class Recorder {
 public:
  /// @param scene, network, controls must live as long as this
  Recorder(const ExperimentScene& scene, const RunNetwork& network,
           const SimulationControls& controls, std::size_t parts);

  /// True if an earlier run has left a state to go on from: latest(), and motion() if it was one
  /// of spheres with mass.
  [[nodiscard]] bool restore();

  /// The times of the next part; empty if all is done.
  [[nodiscard]] std::span<const double> next_part() const;

  /// Takes the state at the next of those times, or an extreme before it. Throws Interrupted, with
  /// a checkpoint of the last whole part left behind, and Error(numerical) where a load goes
  /// through the organ.
  /// @param contact_push_N of each contact where bodies have mass
  void see(const QuasiStaticState& state, const Eigen::VectorXd& contact_push_N = {});

  /// Where spheres have mass: takes a step of the integrator, to find extremes between those times.
  void follow(const QuasiStaticState& step, const Eigen::VectorXd& contact_push_N);
  /// Marks a discontinuity: values from now on are not smooth with those before.
  void corner();

  /// Ends a part at the state last seen; now and then writes a checkpoint.
  /// @param error_estimate of the part, N or m
  void close_part(double error_estimate);
  /// The same where spheres have mass.
  void close_part(InertialState motion, const InertialEnergy& energy,
                  const std::vector<ProbeImpact>& impacts);

  /// The state at the end of the last part; none before the first.
  [[nodiscard]] const QuasiStaticState* latest() const {
    return whole_.curve > 0 ? &whole_.state : nullptr;
  }
  [[nodiscard]] const InertialState* motion() const {
    return whole_.motion ? &*whole_.motion : nullptr;
  }
  [[nodiscard]] SimulationRecord take() { return std::move(record_); }

 private:
  using Clock = std::chrono::steady_clock;
  /// Part of the record that stands in whole parts.
  struct Whole {
    std::size_t curve = 0, outputs = 0;
    std::size_t watched = 0;  ///< of the watched times
    Validity validity;
    QuasiStaticState state;
    std::optional<InertialState> motion;
  };

  void require_within(const QuasiStaticState& state) const;
  [[nodiscard]] CurvePoint point_of(const QuasiStaticState& state,
                                    const Eigen::VectorXd& contact_push_N) const;
  void keep(const QuasiStaticState& state, const Eigen::VectorXd& contact_push_N);
  void insert_extremes();
  void close();
  void save();
  [[noreturn]] void stop(double time_s);

  const ExperimentScene& scene_;
  const RunNetwork& network_;
  const SimulationControls& controls_;
  std::string identity_;
  ValidityWatch watch_;
  CurveExtremes extremes_;
  std::vector<CurvePoint> found_;  ///< extremes that the curve does not have yet
  std::vector<double> times_;
  std::vector<double> part_ends_s_;  ///< rising, the last the end of times_
  std::size_t watched_ = 0;          ///< of times_
  Clock::time_point saved_;
  SimulationRecord record_;
  QuasiStaticState seen_;
  Whole whole_;
};

/// Runs part by part. `run_part` shows the recorder the states at the times of a part, and closes
/// it.
template <class RunPart>
[[nodiscard]] SimulationRun run_in_parts(const ExperimentScene& scene, const RunNetwork& network,
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
  PartOfProtocol(const ExperimentScene& scene, double end_s);
  Protocol protocol;
  double tolerance;
};

}  // namespace tpm::organ
