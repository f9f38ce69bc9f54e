#include "tpm/plan/plan_relevance.hpp"

#include <fmt/format.h>

#include <cmath>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::plan {
namespace {

constexpr double kServoShare = 0.5;    // of a period: what else happens in it needs the rest
constexpr double kAffordable = 1.2e6;  // steps times spheres of a run with masses
constexpr double kInertiaTolerance = 1e-4;

/// The tissue of the reference with one part changed.
Trajectory answer_of(const PlanScene& scene, const PlanSurrogate& like,
                     const PlanAllowance& allowance) {
  QuasiStaticOptions options;
  options.tolerance = PlanSurrogate::kTolerance;
  return scene.quasi_static(options, like.times(), like.wants_field(), allowance.left_s());
}

/// About what a run with masses takes.
OperationCount work_with_masses(const DrivenNetwork& driven, double steps) {
  constexpr double kRatesOfStep = 2.0;
  return OperationCount()
      .add(Operation::bond_force,
           2.0 * kRatesOfStep * steps * static_cast<double>(driven.bonds.size()))
      .add(Operation::dense_flop,
           60.0 * kRatesOfStep * steps * static_cast<double>(driven.rest.cols()));
}

/// Runs the scene with a part switched off.
template <class Change>
PlanRelevance switched_off(const PlanSurrogate& surrogate, const PlanAllowance& allowance,
                           std::string part, std::string note, Change&& change) {
  PlanRelevance result;
  result.part = std::move(part);
  result.note = std::move(note);
  OperationCount work = surrogate.coarse_or_first().work;
  work += surrogate.work_to_compare();
  if (!allowance.permits(work)) {
    result.note = fmt::format("not tried: a run takes some {} s more (--thorough)",
                              significant(nominal_costs().seconds_of(work), 1));
    return result;
  }
  try {
    const PlanScene without = std::forward<Change>(change)(surrogate.scene());
    result.error = trajectory_error(answer_of(without, surrogate, allowance), surrogate.coarse(),
                                    surrogate.measure());
  } catch (const Error& error) {
    result.note = allowance.is_spent() ? "not found: the plan may not take longer (--thorough)"
                                       : fmt::format("cannot be switched off: {}", error.what());
  }
  return result;
}

PlanRelevance relevance_of_viscosity(const PlanSurrogate& surrogate,
                                     const PlanAllowance& allowance) {
  PlanRelevance relaxed = switched_off(surrogate, allowance, "viscosity", "",
                                       [](const PlanScene& scene) { return scene.all_relaxed(); });
  PlanRelevance elastic =
      switched_off(surrogate, allowance, "viscosity", "",
                   [](const PlanScene& scene) { return scene.nothing_relaxing(); });
  if (relaxed.error && elastic.error) {
    const double of_relaxed = *relaxed.error, of_elastic = *elastic.error;
    PlanRelevance& less = of_relaxed <= of_elastic ? relaxed : elastic;
    less.note = fmt::format("everything at equilibrium: {} % of the peak; nothing relaxing: {} %",
                            significant(100.0 * of_relaxed, 3), significant(100.0 * of_elastic, 3));
    return less;
  }
  return relaxed.error ? relaxed : elastic;
}

PlanRelevance relevance_of_tension(const PlanSurrogate& surrogate, const PlanAllowance& allowance) {
  return switched_off(
      surrogate, allowance, "tension", "lateral bonds without stiffness",
      [](const PlanScene& scene) {
        return scene.with_materials([](BondMaterial& material) { material.lateral_Pa = 0.0; });
      });
}

PlanRelevance relevance_of_layers(const PlanSurrogate& surrogate, const PlanAllowance& allowance) {
  const int moving = surrogate.scene().moving_layers();
  if (moving < 2) {
    return {"layers", std::nullopt, false, false, "only the outer layer moves"};
  }
  return switched_off(surrogate, allowance, "layers", fmt::format("layer {} fixed", moving),
                      [&](const PlanScene& scene) { return scene.with_layers(moving - 1); });
}

PlanRelevance relevance_of_inertia(const PlanSurrogate& surrogate, const PlanAllowance& allowance) {
  PlanRelevance result;
  result.part = "inertia";
  try {
    if (surrogate.inertial()) {
      const Trajectory& massless = surrogate.coarse();
      result.error = trajectory_error(massless, surrogate.with_masses_as_fine_as(kInertiaTolerance),
                                      surrogate.measure());
      return result;
    }
    const InertiaEstimate& estimate = surrogate.inertia();
    result.error = surrogate.inertia_share();
    result.estimated = true;
    result.note = "by the linear network";
    if (std::isinf(estimate.of_jumps)) {
      result.note += "; a jump of depth has no meaning with masses and is left out";
      return result;
    }
    if (estimate.of_jumps > 0.0) {
      const double peak = surrogate.coarse_or_first().response.cwiseAbs().maxCoeff();
      result.note += fmt::format("; a load step would ring by {} % of the peak",
                                 significant(100.0 * estimate.of_jumps / peak, 3));
      return result;
    }
    if (!surrogate.scene().driven().tools.empty()) {
      // A run would count the instants at which a tool leaves a sphere, and its force is 0.
      result.note += "; the instants at which a tool leaves and strikes are left out";
      return result;
    }
    const double steps = 10.0 * estimate.highest_Hz * surrogate.scene().duration_s();
    if (steps * static_cast<double>(surrogate.scene().network().organ.size()) > kAffordable ||
        !allowance.permits(work_with_masses(surrogate.scene().driven(), steps))) {
      return result;
    }
    const PlanSurrogate moving(surrogate.scene(), surrogate.measure(), true);
    const Trajectory& reference = moving.with_masses(kInertiaTolerance);
    result.error = trajectory_error(moving.coarse(), reference, surrogate.measure());
    result.estimated = false;
    result.note.clear();
  } catch (const Error& error) {
    result.error.reset();
    result.note = fmt::format("not compared: {}", error.what());
  }
  return result;
}

}  // namespace

std::optional<std::string> over_budget(const PlanModel& model, const ModelClaim& claim,
                                       double duration_s, const PlanBudget& budget,
                                       const OperationCosts& costs) {
  if (budget.rate_Hz) {
    if (const auto reason = model.why_no_servo())
      return fmt::format("not for a servo: {}", *reason);
    const double period = costs.seconds_of(claim.of_period);
    const double allowed = kServoShare / *budget.rate_Hz;
    if (!(period <= allowed)) {
      return fmt::format("a period takes {} us, {} are allowed", significant(1e6 * period, 3),
                         significant(1e6 * allowed, 3));
    }
  }
  if (budget.wall_s_per_s) {
    const double cost = costs.seconds_of(claim.work) / duration_s;
    if (!(cost <= *budget.wall_s_per_s)) {
      return fmt::format("takes {} s per s, {} are allowed", significant(cost, 3),
                         significant(*budget.wall_s_per_s, 3));
    }
  }
  return std::nullopt;
}

std::vector<PlanRelevance> plan_relevance(const PlanSurrogate& surrogate, double tolerance,
                                          const PlanAllowance& allowance) {
  std::vector<PlanRelevance> all{
      relevance_of_inertia(surrogate, allowance), relevance_of_layers(surrogate, allowance),
      relevance_of_tension(surrogate, allowance), relevance_of_viscosity(surrogate, allowance)};
  for (PlanRelevance& part : all) {
    if (part.error) part.matters = *part.error > tolerance;
  }
  return all;
}

}  // namespace tpm::plan
