#pragma once
#include <optional>
#include <span>

#include "tpm/fit/likelihood/experiment_residuals.hpp"
#include "tpmkit/error.hpp"

namespace tpm::fit {

/// Why no start could be evaluated: the first recording with samples in its fitted window that the
/// law does not predict (a contact that shrinks or grows again, docs/laws.md), which of them, and
/// what to do. Nothing if the law predicts them all.
/// @param natural estimated parameters, SI
[[nodiscard]] std::optional<Error> unpredicted_window(const ExperimentResiduals& function,
                                                      std::span<const double> natural);

}  // namespace tpm::fit
