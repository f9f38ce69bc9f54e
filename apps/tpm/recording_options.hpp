#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "tpm/files/import/import.hpp"
#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::app {

/// What the user says about recordings that are read without a description.
struct RecordingOptions {
  std::vector<std::string> files;
  ImportOptions import;  ///< what needs no reading: columns, segments, signs
  std::string drive_quantity, response_quantity;
  std::vector<std::string> units;
  std::string contact_response;
  std::string rest_length, area;
  std::string spring_constant;
};

/// Reads --drive-quantity, --response-quantity (may be empty) and the pairs "COLUMN=UNIT" of
/// --unit. Throws Error(usage).
void set_quantities(ImportOptions& import, const std::string& drive, const std::string& response,
                    const std::vector<std::string>& units);

/// Adds the options above; `files` is the command's own.
void add_recording_options(CLI::App& command, RecordingOptions& options);

[[nodiscard]] ImportOptions import_options(const RecordingOptions& options);

/// Reads and prepares every file.
[[nodiscard]] std::vector<PreparedRecording> read_recordings(const RecordingOptions& options);

/// --family classical|fractional|all.
void add_family_option(CLI::App& command, std::string& family);

/// The laws that --laws names, or those of --family if it names none. Throws Error(bad_input).
[[nodiscard]] std::vector<LawSpec> chosen_laws(const std::vector<std::string>& names,
                                               const std::string& family);

}  // namespace tpm::app
