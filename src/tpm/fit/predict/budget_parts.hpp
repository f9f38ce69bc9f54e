#pragma once
// Parts that the budgets of one contact and of an organ share.
#include <functional>

#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/fit/predict/prediction_parts.hpp"

namespace tpm::fit {

/// The stage `law`: its exact answer along a motion.
[[nodiscard]] BudgetStage law_stage(const LawFile& law, const Protocol& motion,
                                    const std::vector<double>& times_s);

/// Forces of a model that is stepped once a period from the start of a motion on.
struct SteppedForces {
  double start_s = 0.0, period_s = 1e-3;
  std::vector<double> force_N;
};
/// @param step told the depth of each period, m; returns the force, N
[[nodiscard]] SteppedForces stepped_forces(const Protocol& motion, double period_s,
                                           double encoder_step_m,
                                           const std::function<double(double)>& step);

/// Throws Error(bad_input) for numbers out of range.
void require_possible(const BudgetDevice& device);

/// Adds the stages from the loop to the hand.
/// @param loop of the first of them, without forces
void add_device_stages(std::vector<BudgetStage>& stages, const SteppedForces& smooth,
                       const SteppedForces& quantised, const std::vector<double>& times_s,
                       const BudgetDevice& device, const BudgetStage& loop);

/// Half the width of a prediction's band of the mean, within the ramp and hold of a recording.
void add_random_part(ErrorBudget& budget, const LawPrediction& prediction);
/// The same along a motion from the surface; a flag if the law carries no uncertainty.
void add_random_part(ErrorBudget& budget, const LawFile& law, const Protocol& motion,
                     const BudgetOptions& options);

}  // namespace tpm::fit
