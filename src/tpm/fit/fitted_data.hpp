#pragma once
#include <optional>
#include <span>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// Autocorrelation of the residuals over all recordings, in the order of measurement; none without
/// a recording. Readings of tables are independent and not in it.
/// @param natural estimated parameters, SI
[[nodiscard]] std::optional<Correlation> correlation_at(const ExperimentResiduals& function,
                                                        std::span<const double> natural);

/// Fitted values over the independent readings among them: those of the recordings and every
/// reading of a table; 1 if the configuration does not adjust for correlation.
[[nodiscard]] double inflation_at(const ExperimentResiduals& function,
                                  std::span<const double> natural);

/// Fills data, recordings and chi-square of a result whose best, covariance and config are known.
void fill_data(FitResult& result, const ExperimentResiduals& function,
               std::span<const FitParameter> parameters, const Threshold& threshold);

}  // namespace tpm::fit
