#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/fit/validate/validation.hpp"

namespace tpm::fit {

/// Writes validation.csv, validation.json, figures.json and its figures as SVG, PNG and PDF into
/// `folder`: E with U against the requirement, and the motion beside those of the calibration.
/// Returns the names of the files. Throws Error(environment) if drawing is not possible; the other
/// files are then already there.
[[nodiscard]] std::vector<std::string> write_validation_report(const std::filesystem::path& folder,
                                                               const ValidationRequest& request,
                                                               const Validation& validation);

}  // namespace tpm::fit
