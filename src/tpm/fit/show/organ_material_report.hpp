#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/fit/predict/organ_material.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Writes scene.json, session.json, material.json, material.csv, figures.json and the figure into
/// `folder`. Returns the names of the files. Throws Error(environment) if drawing is not possible;
/// the other files are then already there.
[[nodiscard]] std::vector<std::string> write_organ_material_report(
    const std::filesystem::path& folder, const OrganMaterial& result);

}  // namespace tpm::fit
