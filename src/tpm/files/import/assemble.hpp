#pragma once
#include <string>

#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// Gives an imported series the project's own form and adds what it measures (rows, sampling,
/// range, peak) to its findings. `usual` is its provenance unless options.provenance says
/// otherwise. Throws Error(bad_input) if times do not increase or a standard deviation is negative.
[[nodiscard]] ImportedCurve assemble_curve(ImportedSeries series, const std::string& file,
                                           const ImportOptions& options, Provenance usual);

/// A series as a recording in SI: its last column is the response, any other besides time the
/// drive. The same checks and findings as assemble_curve, without writing the numbers out and
/// reading them back. header.sha256 stays empty.
[[nodiscard]] RecordingFile assemble_recording(ImportedSeries series, const std::string& file,
                                               const ImportOptions& options, Provenance usual);

/// True for a table of frequency, storage and loss.
[[nodiscard]] bool holds_spectrum(const ImportedSeries& series);

/// A spectrum in SI. Throws Error(bad_input) for a series without frequency, storage and loss, or
/// one that find_spectrum_fault refuses. header.sha256 stays empty.
[[nodiscard]] Spectrum assemble_spectrum(ImportedSeries series, const std::string& file,
                                         const ImportOptions& options, Provenance usual);

}  // namespace tpm::files
