#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tpm/fit/groups/specimens.hpp"
#include "tpm/law/contact_geometry.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Storage and loss of a data set over frequency with the fitted law, both axes logarithmic; what
/// is not above 0 cannot be drawn and is counted in the caption.
/// @param choice place of a data set of protocol `oscillation` in the fit's configuration
[[nodiscard]] Figure spectrum_figure(const FitResult& fit, std::size_t choice);

/// Each recording's own estimate and interval beside the typical specimen, its interval and the
/// range of a new specimen (of two specimens their spread): a panel for each pooled parameter,
/// three to a figure.
[[nodiscard]] std::vector<Figure> specimen_figures(const SpecimenStudy& study);

/// Writes the fit's tables as CSV (fit_csv.hpp), law.json (of a law or the element, for tpm predict
/// and tpm hil), answer.json (to_json), fit.html (fit_page), figures.json and, as SVG, PNG and PDF,
/// a figure for each recording and each spectrum of a fit and its waterfall. Returns the names of
/// the files. Throws Error(environment) if drawing is not possible; figures.json is then already
/// there.
[[nodiscard]] std::vector<std::string> write_fit_report(const std::filesystem::path& folder,
                                                        const FitResult& fit);

/// The same for recordings that were fitted one by one; writes specimens.json with its tables too.
[[nodiscard]] std::vector<std::string> write_specimen_report(
    const std::filesystem::path& folder, const SpecimenStudy& study,
    const std::optional<ContactGeometry>& probe = {});

}  // namespace tpm::fit
