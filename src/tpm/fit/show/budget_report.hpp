#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// The waterfall: how the lines add up at the instant of the largest sum, and beside it each line's
/// own largest with the thresholds of a hand. A line too small for the axis has no point there: its
/// label says so.
[[nodiscard]] Figure budget_figure(const ErrorBudget& budget);

/// Writes budget.json, budget.csv, figures.json and the figure into `folder`; returns the names of
/// the files.
[[nodiscard]] std::vector<std::string> write_budget_report(const std::filesystem::path& folder,
                                                           const ErrorBudget& budget);

}  // namespace tpm::fit
