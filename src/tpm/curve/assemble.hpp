#pragma once
#include <string>

#include "tpm/curve/import.hpp"

namespace tpm {

/// Gives an imported series the project's own form and adds what it measures (rows, sampling,
/// range, peak) to its findings. `usual` is its provenance unless options.provenance says
/// otherwise. Throws Error(bad_input) if times do not increase or a standard deviation is negative.
[[nodiscard]] ImportedCurve assemble_curve(ImportedSeries series, const std::string& file,
                                           const ImportOptions& options, Provenance usual);

}  // namespace tpm
