#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tpm/fit/groups/group_comparison.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Left: how far the second group lies from the first, as ratios with intervals around 1
/// (quantities that may be negative are left out). Right: the specimens of each group and the
/// typical one, for the first two quantities that both groups determine.
[[nodiscard]] Figure comparison_figure(const GroupComparison& comparison);

/// Writes comparison.json, comparison.csv, specimens.csv and the figure. Returns the names.
[[nodiscard]] std::vector<std::string> write_comparison_report(
    const std::filesystem::path& folder, const GroupComparison& comparison,
    const std::optional<ContactGeometry>& probe);

}  // namespace tpm::fit
