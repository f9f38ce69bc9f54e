#pragma once
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/run/scene_runner.hpp"
#include "tpm/plan/operations.hpp"

namespace tpm::plan {

/// Results that a tolerance is about.
enum class PlanOutput {
  force,  ///< the response: contact force, or depth under a load
  field,  ///< the displacements of all spheres
};

/// By which an error is measured.
struct PlanMeasure {
  PlanOutput output = PlanOutput::force;
  /// Of the error of the response relative to itself, as a hand feels stiffness, wherever the
  /// response is more than a tenth of its peak; 0: not asked for. Only with `force`.
  double relative_weight = 0.0;
};

/// Largest absolute difference over all times (field: and spheres), in parts of the largest
/// absolute value of the reference; with a relative weight, the larger of that and the weighted
/// relative difference.
[[nodiscard]] double trajectory_error(const Trajectory& model, const Trajectory& reference,
                                      const PlanMeasure& measure);

/// The protocol's pieces sampled densely near their ends, where rates change: 1 to `per_piece`
/// times a piece of positive length, and the corners; at most about `most` in all.
[[nodiscard]] std::vector<double> sampled_times(const Protocol& protocol, int per_piece, int most);
/// These, and as many others at most, even in the logarithm of the time since each piece began,
/// from a tenth of the relaxation time on: a long piece would pass over what calms down early.
[[nodiscard]] std::vector<double> sampled_times(const Protocol& protocol, int per_piece, int most,
                                                double tau_s);

struct RestAnswers;

/// The counted work of the runs of a scene and of all that were made from it; several threads may
/// add to it.
class WorkSpent {
 public:
  void add(const OperationCount& work);
  [[nodiscard]] OperationCount all() const;
  /// Told how far a run with masses has come, 0 to 1: these take long. Set before the runs.
  std::function<void(double share)> run_reached;

 private:
  mutable std::mutex mutex_;
  OperationCount work_;
};

/// A scene with its network, and the runs of the full nonlinear network on it.
class PlanScene {
 public:
  /// Throws Error(bad_input) for scenes that no plan is made for: static ones, and the mass-spring
  /// model.
  explicit PlanScene(ExperimentScene scene);

  [[nodiscard]] const ExperimentScene& scene() const { return scene_; }
  [[nodiscard]] const DrivenNetwork& driven() const { return network_->driven; }
  [[nodiscard]] const Network& network() const { return network_->network; }
  [[nodiscard]] const Protocol& protocol() const { return scene_.protocol; }
  [[nodiscard]] double duration_s() const;
  [[nodiscard]] bool by_depth() const { return protocol().drive() == Drive::displacement; }
  [[nodiscard]] bool has_tools() const { return !network_->driven.tools.empty(); }
  /// Contacts besides the first have protocols of their own.
  [[nodiscard]] bool has_own_protocols() const { return scene_.has_own_protocols(); }
  /// Loads act all along, and the tissue sags before anything is imposed.
  [[nodiscard]] bool has_loads() const { return scene_.dead_load_N.size() > 0; }
  /// The times at which anything imposed changes its rate or jumps: protocol(), or where contacts
  /// have protocols of their own the corners of all, with their numbers as values.
  [[nodiscard]] Protocol corners() const;
  /// One sphere driven itself and nothing else in contact.
  [[nodiscard]] bool single_sphere() const;
  /// True if the imposed quantity jumps, at the start or later.
  [[nodiscard]] bool jumps() const;
  /// Layers of which a sphere moves.
  [[nodiscard]] int moving_layers() const;
  [[nodiscard]] const RunNetwork& run_network() const { return *network_; }
  /// Answers of the network at rest; scenes that differ in their protocols alone share them.
  [[nodiscard]] RestAnswers& at_rest() const { return *at_rest_; }
  /// Cost so far of the runs of this scene, and of all scenes that were changed from it or it
  /// from.
  [[nodiscard]] WorkSpent& spent() const { return *spent_; }

  /// The network without masses. Throws Error(numerical) as QuasiStatic does, and after `most_s`.
  /// @param times_s rising
  /// @param most_s that the run may take, at nominal costs
  [[nodiscard]] Trajectory quasi_static(
      const QuasiStaticOptions& options, const std::vector<double>& times_s, bool with_field,
      double most_s = std::numeric_limits<double>::infinity()) const;
  /// The network with masses.
  [[nodiscard]] Trajectory inertial(const InertialOptions& options,
                                    const std::vector<double>& times_s, bool with_field) const;

  // The same scene changed in one respect.
  [[nodiscard]] PlanScene deeper(double factor) const;   ///< what is imposed times a factor
  [[nodiscard]] PlanScene faster(double factor) const;   ///< the protocol in less time
  [[nodiscard]] PlanScene stiffer(double factor) const;  ///< E1, E2, E' times a factor
  [[nodiscard]] PlanScene nothing_relaxing() const;  ///< bonds keep their instantaneous stiffness
  /// Bonds have their equilibrium stiffness from the first instant on. An elastic network like the
  /// other: one that relaxes fast takes too many steps where E2 >> E1.
  [[nodiscard]] PlanScene all_relaxed() const;
  /// Another protocol of the scene; those of contacts stay.
  [[nodiscard]] PlanScene with_protocol(Protocol protocol) const;
  [[nodiscard]] PlanScene with_materials(const std::function<void(BondMaterial&)>& change) const;
  /// Spheres of deeper layers held: `layers` outer ones move.
  [[nodiscard]] PlanScene with_layers(int layers) const;

 private:
  PlanScene(ExperimentScene scene, const PlanScene& same_network);
  PlanScene(ExperimentScene scene, std::shared_ptr<WorkSpent> spent);
  [[nodiscard]] PlanScene with_all_protocols(
      const std::function<Protocol(const Protocol&)>& change) const;

  ExperimentScene scene_;
  std::shared_ptr<const RunNetwork> network_;
  std::shared_ptr<RestAnswers> at_rest_;
  std::shared_ptr<WorkSpent> spent_;
};

}  // namespace tpm::plan
