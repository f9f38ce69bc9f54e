#pragma once
#include <CLI/CLI.hpp>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tpm/files/import/import.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/select/recording_setup.hpp"

namespace tpm::app {

/// Options for reading a file as typed, the same for every command.
struct ReadingArguments {
  std::map<std::string, std::string> texts;  ///< by the keys of reading_options()
  std::vector<std::string> units;            ///< "COLUMN=UNIT"
};

/// Adds them in one group of the help.
void add_reading_options(CLI::App& command, ReadingArguments& arguments, const char* group);

/// Throws Error(bad_input) naming the option.
[[nodiscard]] ImportOptions reading_of(const ReadingArguments& arguments);

/// Statements of the user on recordings that are read without a description.
struct RecordingOptions {
  std::vector<std::string> files;
  ReadingArguments reading;
  std::string contact_response;
};

/// Contact and zero as the user states them; measured if empty.
struct PlacementArguments {
  std::string contact, zero;
};

/// --contact and --zero.
void add_placement_options(CLI::App& command, PlacementArguments& arguments);

/// Holds what was said. Throws Error(usage) for a contact beside --contact-force, or one that a
/// recording does not go beyond.
/// @param recordings not empty
void hold_placement(const PlacementArguments& arguments, const RecordingOptions& options,
                    std::span<const PreparedRecording> recordings, std::optional<double>& contact,
                    std::optional<double>& zero);

/// Throws Error(usage) where there is no recording whose placement could be held.
void require_nothing_held(const PlacementArguments& arguments);

/// Adds the options above; `files` is the command's own.
void add_recording_options(CLI::App& command, RecordingOptions& options);

[[nodiscard]] ImportOptions import_options(const RecordingOptions& options);

/// Reads and prepares every file.
[[nodiscard]] std::vector<PreparedRecording> read_recordings(const RecordingOptions& options);

/// Prepares a recording that was read.
[[nodiscard]] PreparedRecording prepared(const std::string& name, RecordingFile file,
                                         const RecordingOptions& options);

/// --family classical|fractional|all in a group of the help; classical where it is missing.
void add_family_option(CLI::App& command, std::string& family, const char* group);

/// The laws that --laws names, or those of --family if it names none, classical if that is empty.
/// Throws Error(bad_input).
[[nodiscard]] std::vector<LawSpec> chosen_laws(const std::vector<std::string>& names,
                                               const std::string& family);

}  // namespace tpm::app
