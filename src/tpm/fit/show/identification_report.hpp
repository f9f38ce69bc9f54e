#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "tpm/fit/online/identification.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Writes identification.json, law.json, figures.json and the figure into `folder`; returns the
/// names of the files.
[[nodiscard]] std::vector<std::string> write_identification_report(
    const std::filesystem::path& folder, const Identification& identification, const LawFile& law,
    const Json& answer);

}  // namespace tpm::fit
