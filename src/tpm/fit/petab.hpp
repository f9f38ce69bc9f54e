#pragma once
#include <filesystem>
#include <vector>

#include "tpm/fit/fit.hpp"

namespace tpm::fit {

/// A fit, and its data if they are in memory.
struct FitProblem {
  FitConfig config;
  std::vector<DataSet> data;  ///< one for each of config.data; or empty: the fit loads them
};

/// Reads a configuration (schemas/fit.schema.json), or a problem file with tables after PEtab
/// (schemas/fit_tables.schema.json, docs/fit_files.md). What a table holds of PEtab and this reader
/// does not support is refused by name. Throws Error(bad_input) with the file and the key, or the
/// line and the column.
[[nodiscard]] FitProblem read_fit_problem(const std::filesystem::path& path);

/// run_fit() of the problem.
[[nodiscard]] FitResult run_fit(const FitProblem& problem);

}  // namespace tpm::fit
