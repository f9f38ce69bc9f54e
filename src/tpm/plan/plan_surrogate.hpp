#pragma once
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "tpm/base/namespaces.hpp"
#include "tpm/plan/rest_answers.hpp"

namespace tpm::plan {

/// The static force of a contact over its depths: at equilibrium, and the relaxing part.
struct ContactCurves {
  DepthCurve equilibrium, relaxing;
};

/// Source of the claims about a scene: coarse runs of its network at few times, its linear
/// behaviour about rest, and what masses would do. Everything is found when first asked for. What
/// throws Error(numerical) does so each time.
class PlanSurrogate {
 public:
  /// @param inertial what is asked for is the network with masses
  /// @param most_s that each run without masses may take, at nominal costs
  PlanSurrogate(PlanScene scene, const PlanMeasure& measure, bool inertial,
                double most_s = std::numeric_limits<double>::infinity());

  [[nodiscard]] const PlanScene& scene() const { return scene_; }
  [[nodiscard]] const PlanMeasure& measure() const { return measure_; }
  [[nodiscard]] bool wants_field() const { return measure_.output == PlanOutput::field; }
  [[nodiscard]] bool inertial() const { return inertial_; }
  [[nodiscard]] const std::vector<double>& times() const { return times_; }
  /// Those of the reference: times(), but where steps with masses end at the times that are asked
  /// for, as they do under tools, others, so that models are verified in steps of their own.
  [[nodiscard]] std::vector<double> times_of_reference() const;

  /// The network without masses, by collocation at a tolerance, at times().
  [[nodiscard]] const Trajectory& collocation(double tolerance) const;
  /// The run at `tolerance` or, if one was made, at a finer one.
  [[nodiscard]] const Trajectory& collocation_as_fine_as(double tolerance) const;
  /// That run was made.
  [[nodiscard]] bool has_collocation_as_fine_as(double tolerance) const;
  [[nodiscard]] bool has_collocation(double tolerance) const {
    return collocation_.contains(tolerance);
  }
  /// That at the surrogate's own tolerance, with which models are compared before they are
  /// verified.
  [[nodiscard]] const Trajectory& coarse() const;
  /// The coarse run where it was made, else the first, at ten times its tolerance.
  [[nodiscard]] const Trajectory& coarse_or_first() const;
  /// About what the coarse run takes if it was not made yet: what a first comparison costs.
  [[nodiscard]] OperationCount work_to_compare() const;
  /// Where a run at ten times its tolerance leaves the model's limits.
  [[nodiscard]] const Validity& validity() const { return rough().validity; }
  /// Cost of that run, the first and coarsest.
  [[nodiscard]] const OperationCount& work_of_first() const { return rough().work; }
  /// Its difference from that run.
  [[nodiscard]] double coarse_error() const;
  /// The network with masses, at times().
  [[nodiscard]] const Trajectory& with_masses(double tolerance) const;
  /// The run at `tolerance` or, if one was made, the coarsest finer one.
  [[nodiscard]] const Trajectory& with_masses_as_fine_as(double tolerance) const;
  /// The tolerance of the finest run that was made, at most `tolerance`.
  [[nodiscard]] double finest_with_masses(double tolerance) const;

  [[nodiscard]] const ContactSpectrum& spectrum() const { return spectrum_at_rest(scene_); }
  [[nodiscard]] const InertiaEstimate& inertia() const;
  /// InertiaEstimate::of_rates in parts of the peak of coarse_or_first().
  [[nodiscard]] double inertia_share() const;
  /// Curves over the depths of the coarse run.
  [[nodiscard]] const ContactCurves& curves() const;
  [[nodiscard]] bool has_curves() const { return curves_.has_value(); }

  /// Cost of the runs that any claim is made from; about, where the coarse one was not made.
  [[nodiscard]] OperationCount work_of_claims() const;

  /// A bound of the error of a model without masses that answers `model` at times(): `kSafety`
  /// times its difference from the coarse run, with masses where those are asked for, and what that
  /// run may add.
  [[nodiscard]] double claim_of(const Trajectory& model) const;

  static constexpr double kSafety = 1.5;
  static constexpr double kTolerance = 1e-4;

 private:
  [[nodiscard]] const Trajectory& rough() const { return collocation(kRoughTolerance); }

  static constexpr double kRoughTolerance = 10.0 * kTolerance;
  PlanScene scene_;
  PlanMeasure measure_;
  bool inertial_;
  double most_s_;
  std::vector<double> times_;
  mutable std::map<double, Trajectory> collocation_, with_masses_;
  mutable std::optional<InertiaEstimate> inertia_;
  mutable std::optional<ContactCurves> curves_;
};

/// The tolerance of CVODES that aims at an error of the response.
[[nodiscard]] InertialOptions inertial_options(const PlanScene& scene, double tolerance);

}  // namespace tpm::plan
