#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

#include "tpm/curve/import.hpp"
#include "tpm/study/recording_setup.hpp"

namespace tpm::app {

/// What the user says about recordings that are read without a description.
struct RecordingOptions {
  std::vector<std::string> files;
  std::string time, drive, response, sd;
  std::string frequency, storage, loss;
  std::string drive_quantity, response_quantity;
  std::vector<std::string> units;
  std::string contact_response;
  std::string rest_length, area;
  std::string spring_constant;
  std::vector<std::string> segments;
  bool negate_drive = false, negate_response = false;
};

/// "COLUMN=UNIT" pairs. Throws Error(usage).
[[nodiscard]] std::map<std::string, std::string> unit_options(
    const std::vector<std::string>& pairs);

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
