#pragma once
#include <optional>
#include <span>
#include <vector>

#include "tpm/fit/petab.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// Probability of calling a law that is right not described.
inline constexpr double kAdequacyLevel = 0.01;

/// Number of samples from the first on in which nothing is loaded: before contact, or before the
/// drive first moves. The last tenth and two more are left out, because contact is found a little
/// late.
[[nodiscard]] std::size_t samples_at_rest(const RecordingPhases& phases);

/// Tests whether the recommended law describes the recordings (judge_adequacy at 1 %, shared among
/// them, and of a recording whose rests tell a drift with a test that the fitted one agrees) and
/// states it in its fit: FitResult::adequacy. If it does not, the law counts as not
/// identified, and each of its parameters as known only if the law described the data.
void state_adequacy(Selection& s, std::span<const PreparedRecording> recordings);

/// Where the data prefer another law decisively (Selection::preferred), the recommended one does
/// not describe them, whatever its residual is beside the noise.
void state_preferred(Selection& s);

/// States that the law does not describe the data, in these words.
void state_as(FitResult& fit, const std::string& not_described);

/// States of a law without memory that it does not describe an unloading with hysteresis
/// (hysteresis_of), unless it is rejected already.
void state_hysteresis(FitResult& fit);

/// States that another law does better decisively: the fitted one does not describe the data.
/// @param by in BIC
void state_better(FitResult& fit, const std::string& law, const std::string& better, double by);

/// The same as state_adequacy() for one fit.
/// @param recordings those that were fitted, in the order of the fit's data
/// @param fits how many fits share the level of 1 %: of a folder, one of each of its specimens
void state_adequacy(FitResult& fit, std::span<const PreparedRecording> recordings,
                    std::size_t fits = 1);

/// The same for a fit whose configuration states the size of the noise, which is then what the
/// residuals are compared with; for recordings without, by their samples at rest. Says nothing of
/// separate readings whose noise is not known. Without a verdict see doubt_untold_noise().
/// @param data what was fitted, one for each of the configuration's data sets
void state_adequacy(FitResult& fit, const std::vector<DataSet>& data);

/// run_fit() of the problem, with its adequacy stated and what its data cannot tell among its flags
/// (configuration_remarks).
[[nodiscard]] FitResult fit_and_judge(const FitProblem& problem);

/// Independent samples that correlated ones count as, in a sum of squares: n (1 - r^2) / (1 + r^2),
/// at the upper confidence bound of their lag-1 correlation.
[[nodiscard]] double independent_samples(const RecordingFit& fit);

/// Parameters that a recording's residuals have to pay for: an equal share of all.
[[nodiscard]] int parameters_each(const FitResult& fit);

}  // namespace tpm::fit
