#pragma once
// Parts that the budgets of one contact and of an organ share.
#include <functional>
#include <span>
#include <vector>

#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/fit/predict/prediction_parts.hpp"

namespace tpm::fit {

/// The stage `law`: its exact answer along a motion.
[[nodiscard]] BudgetStage law_stage(const LawFile& law, const Protocol& motion,
                                    const std::vector<double>& times_s);

/// Steps a model by one period: told the depth, m, returns the force, N.
using PeriodStep = std::function<double(double)>;

/// Forces of a model that is stepped once a period from the start of a motion to its end, each
/// read some time late: linear between periods, before the first the first, after the last the
/// last. Only the forces that are read are kept: memory does not grow with the length of the
/// motion.
/// @param late_s how late, 0 or more
/// @return for each of `late_s` one force for each of `times_s`
[[nodiscard]] std::vector<std::vector<double>> stepped_forces(
    const Protocol& motion, double period_s, double encoder_step_m, const PeriodStep& step,
    std::span<const double> times_s, std::span<const double> late_s);

/// Throws Error(bad_input) for numbers out of range.
void require_possible(const BudgetDevice& device);

/// Adds the stages from the loop to the hand.
/// @param smooth the model in the loop, told exact depths
/// @param quantised the same at its start, told depths in steps of the encoder
/// @param loop the first of the stages, without forces
void add_device_stages(std::vector<BudgetStage>& stages, const Protocol& motion,
                       const PeriodStep& smooth, const PeriodStep& quantised,
                       const std::vector<double>& times_s, const BudgetDevice& device,
                       const BudgetStage& loop);

/// Half the width of a prediction's band of the mean, within the ramp and hold of a recording.
void add_random_part(ErrorBudget& budget, const LawPrediction& prediction);
/// The same along a motion from the surface; a flag if the law carries no uncertainty.
void add_random_part(ErrorBudget& budget, const LawFile& law, const Protocol& motion,
                     const BudgetOptions& options);

}  // namespace tpm::fit
