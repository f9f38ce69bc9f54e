#pragma once
#include "tpm/base/remark.hpp"
#include "tpm/plan/plan.hpp"
#include "tpm/plan/plan_allowance.hpp"

namespace tpm::plan {

/// Effect of switching inertia, the deepest moving layer, tension and viscosity off, each by a
/// run of the reference's formulation without it, as long as the plan may take such a run.
[[nodiscard]] std::vector<PlanRelevance> plan_relevance(const PlanSurrogate& surrogate,
                                                        double tolerance,
                                                        const PlanAllowance& allowance);

/// By what factor each the scene can become deeper, faster and stiffer until the claim of a model
/// leaves the tolerance, its cost the budget, or the scene a limit of validity. A search ends early
/// when its runs have taken, by counted operations, as long as the reference, or a second, but not
/// before four tries; and where the plan may not take another try. The factor is then between
/// `survived` and `factor`.
/// @param reference_s what the reference and its cross-check take at nominal costs
[[nodiscard]] std::vector<PlanChange> plan_changes(const PlanSurrogate& surrogate,
                                                   const PlanModel& model,
                                                   const PlanRequest& request, double reference_s,
                                                   const PlanAllowance& allowance);

/// Limits that the scene passes in its course.
[[nodiscard]] std::vector<Remark> passed_limits(const PlanSurrogate& surrogate);

/// Why a model does not fit a budget; none if it does.
[[nodiscard]] std::optional<std::string> over_budget(const PlanModel& model,
                                                     const ModelClaim& claim, double duration_s,
                                                     const PlanBudget& budget,
                                                     const OperationCosts& costs);

}  // namespace tpm::plan
