#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/select/selection.hpp"
#include "tpm/show/figure.hpp"

namespace tpm::fit {

/// Response over time with the fitted law, the residuals below it, and response over drive; samples
/// outside the window are drawn apart.
[[nodiscard]] Figure recording_figure(const FitResult& fit, std::size_t recording);

/// Deviances in which the starts ended, sorted.
[[nodiscard]] Figure waterfall_figure(const FitResult& fit);

/// Writes what write_recording_report does, with these figures before those of the selection.
[[nodiscard]] std::vector<std::string> write_selection(const std::filesystem::path& folder,
                                                       const Selection& selection,
                                                       std::vector<Figure> figures);

/// Writes config.json (rerun it with tpm fit), law.json, selection.json with its tables as CSV
/// (fit_csv.hpp), fit.html, figures.json and the figures as SVG, PNG and PDF into `folder`. Returns
/// the names of the files. Throws Error(environment) if drawing is not possible; the other files
/// are then already there.
[[nodiscard]] std::vector<std::string> write_recording_report(const std::filesystem::path& folder,
                                                              const Selection& selection);

}  // namespace tpm::fit
