#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/groups/young_moduli.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// The tables of a fit as CSV: the same numbers as in its JSON, SI, one row for each thing, every
/// row with the unit, the reference depth and the level that its numbers depend on.

/// Each parameter: estimate, standard error, interval, bounds, verdict, conditions.
[[nodiscard]] std::string parameters_csv(const FitResult& fit);
/// Each reading of tables, spectra, moduli and compliances with the law's answer.
[[nodiscard]] std::string readings_csv(const FitResult& fit);
/// Each law of a selection.
[[nodiscard]] std::string laws_csv(const Selection& selection);
/// Each parameter of each recording of a folder, and with a probe its Young's moduli.
[[nodiscard]] std::string specimens_csv(const SpecimenStudy& study,
                                        const std::optional<ContactGeometry>& probe = {});
/// Each pooled parameter.
[[nodiscard]] std::string pooled_csv(const SpecimenStudy& study);

/// Each Young's modulus.
[[nodiscard]] std::string moduli_csv(const YoungModuli& moduli);

/// Writes parameters.csv, readings.csv (if there are readings) and samples.csv, samples_2.csv, ...
/// of a fit into a folder. Returns the names.
std::vector<std::string> write_fit_csv(const std::filesystem::path& folder, const FitResult& fit);

}  // namespace tpm::fit
