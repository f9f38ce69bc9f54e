#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Writes budget.json, budget.csv, figures.json and the figure into `folder`; returns the names of
/// the files.
[[nodiscard]] std::vector<std::string> write_budget_report(const std::filesystem::path& folder,
                                                           const ErrorBudget& budget);

}  // namespace tpm::fit
