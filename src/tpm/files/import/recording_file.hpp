#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tpm/files/import/import.hpp"

namespace tpm::files {

/// The interpretation of a file's columns and units: "read as time: column 1 'Time', s;
/// ...". Empty for a file with a description.
/// @param findings of a RecordingFile or a SpectrumFile
[[nodiscard]] std::string columns_words(const std::vector<ImportFinding>& findings);

/// Any recording from one path, without a configuration:
///
/// - a CSV file with its JSON description beside it (or that description, or the id of a curve that
///   comes with tpm) is read as load_recording does; import options are then refused, because the
///   description says everything;
/// - every other file goes through the importer, in memory (import_curves says what it
/// understands).
///
/// header.id is the file's name without its ending, header.sha256 that of its bytes; header.title
/// is the sheet or dataset if there is no other. Throws Error(bad_input) with file, line and
/// column, or naming the option that says what the file does not.
[[nodiscard]] RecordingFile read_recording_file(const std::filesystem::path& path,
                                                const ImportOptions& options = {});

/// Refuses a table with a response and either a time or a drive, of which no column is recognised
/// as the other: Error(bad_input) lists the columns that may be it.
void require_time_and_drive(const RecordingFile& read, const std::string& file);

/// A spectrum read into memory, and what was understood of its file.
struct SpectrumFile {
  Spectrum spectrum;
  std::vector<ImportFinding> findings = {};
  bool from_angle = false;  ///< a magnitude (or the storage) and a phase were measured
};

/// A recording or a spectrum from one path in the same way.
using MeasuredFile = std::variant<RecordingFile, SpectrumFile>;
[[nodiscard]] MeasuredFile read_measured_file(const std::filesystem::path& path,
                                              const ImportOptions& options = {});

/// As read_measured_file; Error(bad_input) if the file holds a recording.
[[nodiscard]] Spectrum read_spectrum_file(const std::filesystem::path& path,
                                          const ImportOptions& options = {});

/// The value of a key in a file: the text or number at the top of its description or, without a
/// description, the one value that the column of that title holds. Throws Error(bad_input) naming
/// the file if there is no such key or the column does not hold one value.
[[nodiscard]] std::string recording_label(const std::filesystem::path& path, std::string_view key,
                                          const ImportOptions& options = {});

}  // namespace tpm::files
