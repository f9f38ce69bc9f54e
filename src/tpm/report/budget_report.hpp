#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/report/figure.hpp"
#include "tpm/study/error_budget.hpp"

namespace tpm::report {

/// Writes budget.json, budget.csv, figures.json and the figure into `folder`; returns the names of
/// the files.
[[nodiscard]] std::vector<std::string> write_budget_report(const std::filesystem::path& folder,
                                                           const ErrorBudget& budget);

}  // namespace tpm::report
