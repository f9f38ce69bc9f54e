#pragma once
#include <vector>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// True if an estimated parameter belongs to the recordings or their noise (contact point, zero
/// error, size of the noise) and not to the material.
[[nodiscard]] bool is_nuisance(const FitConfig& config, std::size_t parameter);

/// True if an estimated parameter sets the depth of contact.
[[nodiscard]] bool is_contact(const FitConfig& config, std::size_t parameter);

/// True for the depth of contact under an imposed force. No rest measures it, unlike that under an
/// imposed depth: on a bound it is undetermined.
[[nodiscard]] bool is_contact_under_load(const FitConfig& config, std::size_t parameter);

/// Moves automatic bounds (EstimatedParameter::widest) out that the estimate stands on. Each time
/// the distance from the start is doubled (on a log scale: ten times as far).
/// @param parameters the bounds of the fit, changed here
/// @return whether any bound was moved
[[nodiscard]] bool widen_pressed_bounds(const FitResult& result, const FitConfig& config,
                                        std::vector<FitParameter>& parameters);

/// Fills ParameterResult::nuisance and conditional_on, and says so in words and remarks. What
/// stands on a bound decides for all parameters that would move by more than a standard error if it
/// were moved by the width of its bounds (linearised).
void mark_conditions(FitResult& result, const ResidualFunction& function);

/// Fills ParameterResult::not_separable from the configuration, and says so in words.
void mark_not_separable(FitResult& result);

}  // namespace tpm::fit
