#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/fit/select/material_function.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Writes config.json, selection.json, law.json, tables as CSV (fit_csv.hpp) and figures of a
/// material function.
/// @returns the names of the files
[[nodiscard]] std::vector<std::string> write_function_report(const std::filesystem::path& folder,
                                                             const MaterialFunction& function,
                                                             const Selection& selection);

}  // namespace tpm::fit
