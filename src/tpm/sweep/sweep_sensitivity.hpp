#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/sensitivity.hpp"
#include "tpm/sweep/sweep_reader.hpp"

namespace tpm::sweep {

/// Sobol indices of a number over an axis of samples of the kind `sensitivity`.
struct SweepSensitivity {
  std::string variable, unit;           ///< SI unit
  std::vector<std::string> parameters;  ///< in the order of `indices.inputs`
  SensitivityDesign design;
  SensitivityResult indices;
  std::vector<FixedValue> fixed;  ///< on the other axes
};

/// Throws Error(bad_input) if the file has no such axis, or as sobol_indices does.
/// @param held places on the other axes
[[nodiscard]] SweepSensitivity sensitivity_of(const SweepReader& sweep, const std::string& variable,
                                              const FixedPlaces& fixed, double level = 0.95);

}  // namespace tpm::sweep
