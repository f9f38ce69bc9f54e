#include "tpm/plan/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/quantity_text.hpp"
#include "tpm/base/require.hpp"
#include "tpm/base/text.hpp"
#include "tpm/plan/perception.hpp"
#include "tpm/plan/plan_allowance.hpp"
#include "tpm/plan/plan_reference.hpp"
#include "tpm/plan/plan_relevance.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::plan {
namespace {

constexpr double kLeastTolerance = 1e-6, kMostTolerance = 0.5;
constexpr double kSlowest_Hz = 1.0, kFastest_Hz = 1e6;
// Largest time of a plan: in parts of its reference and cross-check, and that anyway.
constexpr double kMostOfReference = 2.0, kAnyway_s = 1.5;
/// With masses of the reference alone. Its runs cannot be cut short: what is begun below this limit
/// ends above it.
constexpr double kMostOfReferenceWithMasses = 1.75;

void require_valid(const PlanRequest& request) {
  require_number(request.tolerance >= kLeastTolerance && request.tolerance <= kMostTolerance,
                 "tolerance", request.tolerance, "1e-6 to 0.5 of the peak");
  const PlanBudget& budget = request.budget;
  const double rate_Hz = budget.rate_Hz.value_or(kSlowest_Hz);
  require_number(rate_Hz >= kSlowest_Hz && rate_Hz <= kFastest_Hz, "rate", rate_Hz, "1 to 1e6 Hz",
                 " Hz");
  if (request.for_loop && !budget.rate_Hz) {
    throw bad_input("rate", "is missing", "that of the loop");
  }
  const double wall = budget.wall_s_per_s.value_or(1.0);
  require_number(is_positive(wall), "wall", wall, "a time above 0", " s per s");
}

bool masses_known(const ExperimentScene& scene) {
  return std::all_of(scene.contacts.begin(), scene.contacts.end(),
                     [](const SceneContact& c) { return !c.is_tool() || c.mass_kg.has_value(); });
}

/// True if the reference has masses: the scene says so, or they would be felt at this tolerance.
bool reference_has_masses(const ExperimentScene& scene, const PlanSurrogate& massless,
                          const PlanRequest& request) {
  if (request.for_loop) return false;
  if (scene.formulation.masses) return true;
  if (!masses_known(scene)) return false;
  const InertiaEstimate& estimate = massless.inertia();
  return !std::isinf(estimate.of_jumps) &&
         massless.inertia_share() >= std::max(request.tolerance, kMassesFelt);
}

double most_work_s(double reference_s) {
  return std::max(kMostOfReference * reference_s, kAnyway_s);
}

/// @param first_s of the run at a thousandth of the peak
ExpectedPlanWork expected_after(double first_s, bool inertial, const PlanRequest& request) {
  // Two runs; how much longer than the first they take at tighter tolerances was fitted to the
  // shipped scenes and shells, within a factor of two.
  constexpr double kRuns = 2.0, kOrder = 0.15;
  ExpectedPlanWork expected;
  expected.first_run_s = first_s;
  expected.reference_s = kRuns * first_s * std::pow(request.tolerance, -kOrder);
  if (!inertial && !request.thorough) {
    expected.all_s = most_work_s(expected.reference_s);
  }
  return expected;
}

/// A plan being made.
class Planning {
 public:
  Planning(const ExperimentScene& scene, const PlanRequest& request)
      : scene_(scene), models_(plan_models(scene_)), allowance_(scene_) {
    plan_.title = scene.tissue.title;
    plan_.request = request;
    plan_.by_depth = scene_.by_depth();
    plan_.own_protocols = scene_.has_own_protocols();
    plan_.duration_s = scene_.duration_s();
    plan_.spheres = scene_.network().organ.size();
    plan_.bonds = scene_.network().bonds.size();
    scene_.spent().run_reached = request.run_progress;
    tell("coarse runs of the network");
    PlanSurrogate massless(scene_, request.measure, false);
    plan_.work.first_run_s = nominal_costs().seconds_of(massless.work_of_first());
    plan_.inertial = reference_has_masses(scene, massless, request);
    if (request.expected) {
      request.expected(expected_after(plan_.work.first_run_s, plan_.inertial, request));
    }
    if (!plan_.inertial) estimate_masses(massless);
    if (plan_.inertial) {
      surrogate_.emplace(scene_, request.measure, true);
    } else {
      surrogate_.emplace(std::move(massless));
    }
  }

  Plan make() {
    tell("reference");
    reference_ = verified_reference(*surrogate_, plan_.request.tolerance);
    plan_.reference = reference_.reference;
    plan_.work.reference_run_s = nominal_costs().seconds_of(reference_.trajectory.work);
    plan_.work.reference_s = nominal_costs().seconds_of(reference_.work);
    limit_work();
    tell("candidates");
    for (const auto& model : models_) consider(*model);
    sort();
    tell("verification");
    verify_cheap();
    choose();
    plan_.needs_full = std::none_of(
        plan_.candidates.begin(), plan_.candidates.end(),
        [](const PlannedCandidate& c) { return c.reach == ModelReach::reduced && c.accurate; });
    plan_.validity = passed_limits(*surrogate_);
    if (plan_.request.relevance) {
      tell("what does not matter");
      plan_.relevance = plan_relevance(*surrogate_, plan_.request.tolerance, allowance_);
      settle_masses_left_out();
    }
    if (plan_.request.changes && plan_.choice) {
      tell("robustness margins");
      plan_.changes = plan_changes(*surrogate_, model_of(plan_.chosen()), plan_.request,
                                   plan_.work.reference_s, allowance_);
    }
    plan_.work.all_s = allowance_.spent_s();
    return std::move(plan_);
  }

 private:
  void tell(const std::string& what) const {
    if (plan_.request.progress) plan_.request.progress(what);
  }

  void estimate_masses(const PlanSurrogate& massless) {
    try {
      const double share = massless.inertia_share();
      if (share > plan_.request.tolerance) plan_.masses_left_out = share;
    } catch (const Error& error) {
      plan_.masses_unknown = error.what();
    }
  }

  void limit_work() {
    if (plan_.request.thorough) return;
    allowance_.set_most(plan_.inertial ? kMostOfReferenceWithMasses * plan_.work.reference_run_s
                                       : most_work_s(plan_.work.reference_s));
  }

  [[nodiscard]] const PlanModel& model_of(const PlannedCandidate& candidate) const {
    return **std::find_if(models_.begin(), models_.end(),
                          [&](const auto& m) { return m->name() == candidate.name; });
  }

  void consider(const PlanModel& model) {
    const PlanRequest& request = plan_.request;
    PlannedCandidate candidate;
    candidate.name = model.name();
    candidate.formulation = model.formulation();
    candidate.settings = model.settings();
    candidate.reach = model.reach();
    if (request.for_loop && !model.for_loop()) {
      candidate.reason = "nothing that a loop steps";
    } else if (const auto reason = model.why_not(*surrogate_, request.budget)) {
      candidate.reason = *reason;
    } else if (model.last_resort() && network_found_) {
      candidate.reason = "not tried: a coarser one meets the tolerance";
    } else if (const auto too_long = too_long_to_try(model)) {
      candidate.reason = *too_long;
    } else if (model.has_masses() && with_masses_found_) {
      candidate.reason = "not tried: a cheaper one with masses meets the tolerance";
    } else {
      try {
        assess(model, candidate);
      } catch (const Error& error) {
        if (error.code() != ExitCode::numerical && error.code() != ExitCode::bad_input) throw;
        candidate.reason = fmt::format("fails: {}", error.what());
      }
    }
    plan_.candidates.push_back(std::move(candidate));
  }

  /// Where some model meets tolerance and budget already: a large organ takes minutes to be
  /// condensed, and each run of its network seconds.
  [[nodiscard]] std::optional<std::string> too_long_to_try(const PlanModel& model) const {
    const auto enough = std::find_if(plan_.candidates.begin(), plan_.candidates.end(),
                                     [](const PlannedCandidate& c) { return c.feasible; });
    if (enough == plan_.candidates.end()) return std::nullopt;
    OperationCount work = model.work_to_build(scene_);
    work += model.work_to_claim(*surrogate_);
    const double seconds = nominal_costs().seconds_of(work);
    if (seconds == 0.0 || allowance_.permits(work)) return std::nullopt;
    return fmt::format("not tried: takes some {} s more, and {} meets the tolerance{}",
                       significant(seconds, 1), enough->name,
                       plan_.request.budget.rate_Hz ? " in time" : "");
  }

  void assess(const PlanModel& model, PlannedCandidate& candidate) {
    const PlanRequest& request = plan_.request;
    scene_.spent().add(model.work_to_build(scene_));
    const ModelClaim claim = model.claim(*surrogate_, request.budget);
    candidate.claimed_error = claim.error;
    candidate.cost_s_per_s = request.costs.seconds_of(claim.work) / plan_.duration_s;
    if (request.budget.rate_Hz && !model.why_no_servo()) {
      candidate.period_s = request.costs.seconds_of(claim.of_period);
    }
    candidate.accurate = claim.error <= request.tolerance;
    if (!candidate.accurate) {
      candidate.reason = "the claimed error is above the tolerance";
      return;
    }
    with_masses_found_ = with_masses_found_ || model.has_masses();
    network_found_ = network_found_ || model.reach() == ModelReach::full;
    const auto over = over_budget(model, claim, plan_.duration_s, request.budget, request.costs);
    candidate.feasible = !over;
    if (over) candidate.reason = *over;
  }

  /// By rising cost; the table's order where costs are alike.
  void sort() {
    std::stable_sort(plan_.candidates.begin(), plan_.candidates.end(),
                     [](const PlannedCandidate& a, const PlannedCandidate& b) {
                       if (!a.cost_s_per_s || !b.cost_s_per_s)
                         return a.cost_s_per_s && !b.cost_s_per_s;
                       return *a.cost_s_per_s < *b.cost_s_per_s;
                     });
  }

  /// The error against the reference, whose own uncertainty is added.
  void verify(PlannedCandidate& candidate) {
    const Trajectory answer =
        model_of(candidate).run(*surrogate_, plan_.request.budget, reference_.times_s);
    candidate.verified_error =
        trajectory_error(answer, reference_.trajectory, plan_.request.measure) +
        reference_.reference.difference;
    if (plan_.request.measure.output == PlanOutput::force) return;
    candidate.verified_response_error = trajectory_error(answer, reference_.trajectory, {}) +
                                        reference_.reference.response_difference;
  }

  /// A run's error of masses replaces the estimate: there is one number.
  void settle_masses_left_out() {
    const PlanRelevance& inertia = plan_.relevance.front();
    if (plan_.inertial || !inertia.error) return;
    plan_.masses_unknown.clear();
    plan_.masses_left_out.reset();
    if (inertia.matters) plan_.masses_left_out = inertia.error;
  }

  void verify_cheap() {
    for (PlannedCandidate& candidate : plan_.candidates) {
      if (candidate.claimed_error && model_of(candidate).cheaper_than_reference())
        verify(candidate);
    }
  }

  void choose() {
    for (std::size_t i = 0; i < plan_.candidates.size(); ++i) {
      PlannedCandidate& candidate = plan_.candidates[i];
      if (!candidate.accurate) continue;
      if (!candidate.feasible && plan_.without_budget) continue;
      if (!candidate.verified_error) verify(candidate);
      if (*candidate.verified_error > plan_.request.tolerance) {
        candidate.accurate = candidate.feasible = false;
        candidate.reason = "verified: the error is above the tolerance, and above the claim";
        continue;
      }
      if (!candidate.feasible) {
        plan_.without_budget = i;
        continue;
      }
      plan_.choice = i;
      break;
    }
  }

  PlanScene scene_;
  PlanModels models_;
  Plan plan_;
  std::optional<PlanSurrogate> surrogate_;
  VerifiedReference reference_;
  PlanAllowance allowance_;
  bool with_masses_found_ = false;
  bool network_found_ = false;  ///< a nonlinear network whose claim meets the tolerance
};

}  // namespace

bool try_set_tolerance(PlanRequest& request, const std::string& text) {
  if (text == "jnd") {
    request.tolerance = kForceJnd;
    request.measure.relative_weight = kForceJnd / kStiffnessJnd;
    request.tolerance_source =
        fmt::format("just noticeable differences: force {} %, stiffness {} %",
                    significant(100.0 * kForceJnd, 3), significant(100.0 * kStiffnessJnd, 3));
    return true;
  }
  const std::optional<double> value = find_share(text);
  if (!value || *value < kLeastTolerance || *value > kMostTolerance) return false;
  request.tolerance = *value;
  return true;
}

void set_tolerance(PlanRequest& request, const std::string& text) {
  if (try_set_tolerance(request, text)) return;
  throw Error(ExitCode::usage, "--tolerance", fmt::format("'{}'", printable(text)),
              "a share of the peak such as 1% or 0.01, 1e-6 to 0.5, or jnd");
}

double parse_wall_budget(const std::string& text) {
  constexpr std::string_view kPer = " per s";
  const bool per = text.size() > kPer.size() && text.ends_with(kPer);
  if (per) {
    const double value =
        parse_quantity(text.substr(0, text.size() - kPer.size()), Dimension::time, "--wall");
    if (value > 0.0) return value;
  }
  throw Error(ExitCode::usage, "--wall", fmt::format("'{}'", printable(text)),
              "computing time above 0 per simulated second, such as \"0.1 s per s\"");
}

PlanClaim claim_of(const Plan& plan) {
  const PlanMeasure& measure = plan.request.measure;
  const bool field = measure.output == PlanOutput::field;
  PlanClaim claim;
  claim.quantity = field           ? "displacements of all spheres"
                   : plan.by_depth ? "contact force"
                                   : "indentation depth";
  if (plan.own_protocols && !field) claim.quantity += " of the first contact";
  claim.norm =
      fmt::format("largest absolute difference over the protocol{}, in parts of the {}",
                  field ? " and all spheres" : "", field ? "largest displacement" : "peak");
  if (measure.relative_weight > 0.0) {
    claim.norm += fmt::format(
        "; or {} times the relative difference where the response is above a "
        "tenth of the peak, if that is larger",
        shortest(rounded(measure.relative_weight, 4)));
  }
  claim.protocol = plan.own_protocols ? "the scene's own protocols, no others"
                                      : "the scene's own protocol, no other";
  return claim;
}

Plan make_plan(const ExperimentScene& scene, const PlanRequest& request) {
  require_valid(request);
  return Planning(scene, request).make();
}

ExpectedPlanWork expected_work(const ExperimentScene& scene, const PlanRequest& request) {
  require_valid(request);
  const PlanSurrogate massless(PlanScene(scene), request.measure, false);
  const double first_s = nominal_costs().seconds_of(massless.work_of_first());
  return expected_after(first_s, reference_has_masses(scene, massless, request), request);
}

namespace {

/// The choice of a plan, with the surrogate of its scene.
struct Chosen {
  Chosen(const Plan& plan, const ExperimentScene& scene)
      : surrogate(PlanScene(scene), plan.request.measure, plan.inertial) {
    for (auto& candidate : plan_models(surrogate.scene())) {
      if (candidate->name() == plan.chosen().name) model = std::move(candidate);
    }
    if (!model) throw bad_input("plan", "made for another scene", "a plan of this scene");
  }
  PlanSurrogate surrogate;
  std::unique_ptr<PlanModel> model;
};

}  // namespace

Trajectory run_planned(const Plan& plan, const ExperimentScene& scene,
                       const std::vector<double>& times_s) {
  const Chosen chosen(plan, scene);
  return chosen.model->run(chosen.surrogate, plan.request.budget, times_s);
}

std::vector<std::unique_ptr<ContactModel>> planned_contacts(const Plan& plan,
                                                            const ExperimentScene& scene,
                                                            std::span<const double> periods_s) {
  const Chosen chosen(plan, scene);
  if (!chosen.model->for_loop()) {
    throw bad_input("plan", "chose nothing that a loop steps", "a plan for a loop");
  }
  return chosen.model->contacts(chosen.surrogate, periods_s);
}

ExperimentScene contact_scene(const ExperimentScene& scene, const ContactRange& range) {
  if (!(range.depth_m > 0.0 && range.speed_m_per_s > 0.0 && range.hold_s >= 0.0)) {
    throw bad_input("contact", "a depth or speed that is not above 0, or a rest below 0",
                    "how a hand moves it");
  }
  constexpr double kSlow = 0.2;
  std::vector<Knot> knots{{0.0, 0.0}};
  const auto go = [&](double depth_m, double speed) {
    const double length = std::abs(depth_m - knots.back().value) / speed;
    knots.push_back({knots.back().time_s + length, depth_m});
  };
  const auto rest = [&] {
    if (range.hold_s > 0.0)
      knots.push_back({knots.back().time_s + range.hold_s, knots.back().value});
  };
  go(range.depth_m, range.speed_m_per_s);
  rest();
  go(0.5 * range.depth_m, range.speed_m_per_s);
  rest();
  go(range.depth_m, kSlow * range.speed_m_per_s);
  go(0.0, range.speed_m_per_s);
  ExperimentScene probed = scene;
  probed.protocol = Protocol(Drive::displacement, std::move(knots), "a hand's contact");
  return probed;
}

}  // namespace tpm::plan
