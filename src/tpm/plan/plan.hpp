#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/plan/plan_model.hpp"

namespace tpm::plan {

/// Counted operations of a plan, at nominal costs.
struct PlanWork {
  double first_run_s = 0.0;      ///< of the coarsest run of the network
  double reference_run_s = 0.0;  ///< of the reference alone
  double reference_s = 0.0;      ///< of the reference and its cross-check
  double all_s = 0.0;            ///< of all runs and of what is built
};

/// Expected cost of a plan, from its first run: `all_s` is a bound if the reference takes what is
/// expected, which is within a factor of two; none where masses count, whose first run has none, or
/// the plan is thorough.
struct ExpectedPlanWork {
  double first_run_s = 0.0, reference_s = 0.0;
  std::optional<double> all_s;
};

/// Request of a plan.
struct PlanRequest {
  double tolerance = 0.01;  ///< of the error, in parts of the peak; 1e-6 to 0.5
  PlanMeasure measure;
  std::string tolerance_source;  ///< in words, if it is not a number that was given
  PlanBudget budget;
  OperationCosts costs = nominal_costs();
  /// For the loop of a haptic device: only what it can step, and without masses, which nothing in
  /// the loop has; what they would change is in masses_left_out. Needs a rate.
  bool for_loop = false;
  bool relevance = true;  ///< find out what does not matter
  bool changes = true;    ///< find out robustness margins
  /// Try everything, however long it takes. Else, by nominal costs, a plan takes about twice as
  /// long as its reference and cross-check at most, or 1.5 s; with masses, less than twice as long
  /// as its reference alone.
  bool thorough = false;
  std::function<void(const std::string& what)> progress;  ///< told what is being done
  std::function<void(double share)> run_progress;  ///< told how far a run with masses has come
  std::function<void(const ExpectedPlanWork&)> expected;  ///< told after the first run
};

/// 1e-6 to 0.5, or a threshold of perception: what `--tolerance` means. "1%", "0.01", "jnd".
/// Throws Error(usage).
void set_tolerance(PlanRequest& request, const std::string& text);
/// The same without an error: false if `text` is no tolerance, and the request stays.
[[nodiscard]] bool try_set_tolerance(PlanRequest& request, const std::string& text);
/// "0.1 s per s". Throws Error(usage).
[[nodiscard]] double parse_wall_budget(const std::string& text);

/// A candidate and what came of it.
struct PlannedCandidate {
  std::string name, formulation, settings;
  ModelReach reach = ModelReach::reduced;
  std::optional<double> claimed_error;   ///< bound before verification, in parts of the peak
  std::optional<double> verified_error;  ///< against the reference, its own uncertainty added
  /// The same of the response, where the tolerance is about displacements: nothing was claimed of
  /// it.
  std::optional<double> verified_response_error;
  std::optional<double> cost_s_per_s;  ///< computing time per simulated second
  std::optional<double> period_s;      ///< computing time of the costliest servo period
  bool feasible = false;               ///< meets tolerance and budget
  bool accurate = false;               ///< meets the tolerance, whatever it costs
  std::string reason;                  ///< why it is not feasible
};

/// Reference that verifies the pick.
struct PlanReference {
  std::string method, cross_check;   ///< in words
  double difference = 0.0;           ///< between the two, in parts of the peak
  double response_difference = 0.0;  ///< the same of the response
  double peak = 0.0;                 ///< of the response, N or m
};

/// Effect of switching a part of the physics off.
struct PlanRelevance {
  std::string part;             ///< inertia, layers, tension, viscosity
  std::optional<double> error;  ///< in parts of the peak; none: not found, `note` says why
  bool estimated = false;       ///< by the linear network, not by a run
  bool matters = true;          ///< its error is above the tolerance
  std::string note;
};

/// By how much a scene can change before the pick no longer does.
struct PlanChange {
  std::string change;            ///< "deeper, and as much faster", "faster", "stiffer"
  std::optional<double> factor;  ///< none: not found
  /// Largest factor tried at which the pick holds. At kMostChange nothing breaks; without a factor
  /// and below, the search ended because the plan may not take longer.
  double survived = 1.0;
  std::string breaks;  ///< what breaks there
};
inline constexpr double kMostChange = 16.0;

/// From this part of the peak on (or the tolerance, if that is larger) a plan takes a reference
/// with masses by itself, whatever formulation the scene has. Between the tolerance and this the
/// claims that are shown count them.
inline constexpr double kMassesFelt = 0.05;

struct Plan {
  std::string title;
  PlanRequest request;
  bool inertial = false;  ///< the reference has masses
  /// Where it has none: what they would change, in parts of the peak, if that is above the
  /// tolerance. The same number as that of inertia in `relevance`; without that, by the linear
  /// network. The errors of `candidates` are against the reference and do not count it; claims that
  /// are shown do (shown_error()).
  std::optional<double> masses_left_out;
  /// Why nothing is known of what they would change; empty where it is.
  std::string masses_unknown;
  bool by_depth = true;
  bool own_protocols = false;  ///< contacts besides the first have protocols of their own
  double duration_s = 0.0;
  std::size_t spheres = 0, bonds = 0;
  std::vector<PlannedCandidate> candidates;  ///< by rising cost, those without one last
  std::optional<std::size_t> choice;         ///< none: nothing meets tolerance and budget
  std::optional<std::size_t>
      without_budget;       ///< the cheapest that meets the tolerance, if no choice
  bool needs_full = false;  ///< no reduced model meets the tolerance
  PlanReference reference;
  PlanWork work;
  std::vector<PlanRelevance> relevance;
  std::vector<PlanChange> changes;
  std::vector<Remark> validity;  ///< limits that the scene passes

  [[nodiscard]] const PlannedCandidate& chosen() const { return candidates.at(choice.value()); }
};

/// An error against the reference as it is shown: what candidate and reference both leave out is
/// part of it, wherever that exceeds the tolerance.
[[nodiscard]] inline double shown_error(const Plan& plan, double error) {
  return error + plan.masses_left_out.value_or(0.0);
}
[[nodiscard]] inline std::optional<double> shown_error(const Plan& plan,
                                                       const std::optional<double>& error) {
  return error ? std::optional(shown_error(plan, *error)) : std::nullopt;
}

/// Quantity whose errors a plan states, in words.
struct PlanClaim {
  std::string quantity;  ///< "contact force", "indentation depth" or "displacements of all spheres"
  std::string norm;
  std::string protocol;
};
[[nodiscard]] PlanClaim claim_of(const Plan& plan);

/// The cheapest model for a scene. Throws Error(bad_input) for scenes and requests that no plan is
/// made for, Error(numerical) where the reference itself cannot be computed or its cross-check
/// disagrees.
[[nodiscard]] Plan make_plan(const ExperimentScene& scene, const PlanRequest& request);

/// Runs the network once, coarsely. Throws as make_plan() does.
[[nodiscard]] ExpectedPlanWork expected_work(const ExperimentScene& scene,
                                             const PlanRequest& request);

/// The planned model's answer over the scene's protocol, at the times given.
/// @param plan with a choice, of the same scene
[[nodiscard]] Trajectory run_planned(const Plan& plan, const ExperimentScene& scene,
                                     const std::vector<double>& times_s);

/// Motion of a contact by a hand, as far as a session knows it before it begins.
struct ContactRange {
  double depth_m = 0.0;        ///< deepest, > 0
  double speed_m_per_s = 0.0;  ///< fastest, > 0
  double hold_s = 1.0;         ///< longest rest at a depth, >= 0
};

/// Scene to plan for a contact that a hand moves freely: one whose protocol goes to the
/// whole and to half of the depth at full and at a fifth of the speed, rests there, and comes back.
/// @param scene of which organ, material and contacts are used
[[nodiscard]] ExperimentScene contact_scene(const ExperimentScene& scene,
                                            const ContactRange& range);

/// The planned model for a servo loop to step, at rest, once for each period: what does not depend
/// on the period is found once.
/// @param plan made `for_loop`, with a choice, of the same scene
/// @param periods_s may be others than that of the plan's rate
[[nodiscard]] std::vector<std::unique_ptr<ContactModel>> planned_contacts(
    const Plan& plan, const ExperimentScene& scene, std::span<const double> periods_s);

}  // namespace tpm::plan
