#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/report/figure.hpp"
#include "tpm/study/material_function.hpp"

namespace tpm::report {

/// Relaxation modulus or creep compliance over time, with the fitted law, on logarithmic axes.
/// @param choice place in the fit's data of such readings
[[nodiscard]] Figure step_response_figure(const FitResult& fit, std::size_t choice);

/// Writes config.json, selection.json, law.json, tables as CSV (fit_csv.hpp) and figures of a
/// material function.
/// @returns the names of the files
[[nodiscard]] std::vector<std::string> write_function_report(const std::filesystem::path& folder,
                                                             const MaterialFunction& function,
                                                             const Selection& selection);

}  // namespace tpm::report
