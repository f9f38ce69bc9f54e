#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/fit/predict/law_prediction.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Writes prediction.csv, prediction.json, figures.json and the figure as SVG, PNG and PDF into
/// `folder`. Returns the names of the files. Throws Error(environment) if drawing is not possible;
/// the other files are then already there.
[[nodiscard]] std::vector<std::string> write_prediction_report(const std::filesystem::path& folder,
                                                               const LawPrediction& prediction,
                                                               const Json& answer);

}  // namespace tpm::fit
