#include "recording_options.hpp"
#include "option_kinds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "command.hpp"
#include "tpm/files/import/reading_options.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/likelihood/load_imposed.hpp"
#include "tpm/fit/select/file_remarks.hpp"
#include "tpm/fit/select/placement_parameters.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {

namespace {

/// "step_time" is --step-time on the command line, and "from" is --from-time.
std::string option_name(std::string_view key) {
  if (key == "from") key = "from_time";
  std::string name = fmt::format("--{}", key);
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

}  // namespace

void add_reading_options(CLI::App& command, ReadingArguments& arguments, const char* group) {
  for (const ReadingOption& option : reading_options()) {
    const std::string key(option.key);
    const std::string meaning(option.meaning);
    if (key.starts_with("negate_")) {
      command
          .add_flag_callback(
              option_name(key), [&arguments, key] { arguments.texts[key] = "true"; }, meaning)
          ->group(group);
      continue;
    }
    CLI::Option* added =
        command.add_option(option_name(key), arguments.texts[key], meaning)->group(group);
    const std::vector<std::string> choices = CLI::detail::split(std::string(option.choices), ',');
    if (!option.choices.empty()) added->check(one_of_words(choices));
  }
  command
      .add_option("--unit", arguments.units, "Unit of a column, e.g. \"Force=N\" (may be repeated)")
      ->allow_extra_args(false)
      ->group(group);
}

ImportOptions reading_of(const ReadingArguments& arguments) {
  ImportOptions import;
  for (const auto& [key, text] : arguments.texts) {
    if (text.empty()) continue;
    of_option([&, &name = key, &value = text] {
      set_reading_option(import, name, value, option_name(name));
    });
  }
  for (const std::string& pair : arguments.units) {
    const auto equals = pair.rfind('=');
    if (equals == std::string::npos || equals == 0) {
      throw Error(ExitCode::usage, "--unit", fmt::format("'{}' has no '='", printable(pair)),
                  "COLUMN=UNIT, such as \"Force=N\"");
    }
    of_option([&] {
      set_reading_unit(import, pair.substr(0, equals), pair.substr(equals + 1), "--unit");
    });
  }
  return import;
}

void add_recording_options(CLI::App& command, RecordingOptions& options) {
  const char* group = "Columns and units";
  add_reading_options(command, options.reading, group);
  options_of_group(command, group)(
      "--contact-force", options.contact_response,
      "Force at which contact begins, such as \"0.05 N\" (default: found)");
}

void add_placement_options(CLI::App& command, PlacementArguments& arguments) {
  command.add_option("--contact", arguments.contact,
                     "Depth of contact that is fixed, of recordings, e.g. \"0.3 mm\" (default: the "
                     "onset of the force, measured with its uncertainty)");
  command.add_option(
      "--zero", arguments.zero,
      "Reading without a load that is fixed, of recordings, e.g. \"12 mN\" (default: "
      "measured before contact)");
}

void hold_placement(const PlacementArguments& arguments, const RecordingOptions& options,
                    std::span<const PreparedRecording> recordings, std::optional<double>& contact,
                    std::optional<double>& zero) {
  const Recording& first = recordings.front().recording;
  const auto set = [](std::optional<double>& held, const std::string& text, Quantity quantity,
                      const char* option) {
    if (!text.empty()) held = option_quantity(text, quantity_dimension(quantity), option);
  };
  set(contact, arguments.contact, law_drive(first), "--contact");
  set(zero, arguments.zero, law_response(first), "--zero");
  if (!contact) return;
  if (!options.contact_response.empty()) {
    throw Error(ExitCode::usage, "--contact", "beside --contact-force", "one of them");
  }
  require_contact_within(*contact, recordings, "--contact");
}

void require_nothing_held(const PlacementArguments& arguments) {
  if (arguments.contact.empty() && arguments.zero.empty()) return;
  throw Error(ExitCode::usage, "--contact, --zero", "with a protocol",
              "them with a recording; a protocol counts from the surface");
}

ImportOptions import_options(const RecordingOptions& options) {
  return reading_of(options.reading);
}

PreparedRecording prepared(const std::string& name, RecordingFile file,
                           const RecordingOptions& options) {
  PhaseOptions phases;
  if (!options.contact_response.empty()) {
    phases.contact_response =
        option_quantity(options.contact_response, Dimension::force, "--contact-force");
  }
  require_time_and_drive(file, name);
  std::string read_as = columns_words(file.findings);
  PreparedRecording recording = prepare_recording(name, std::move(file.recording), phases);
  recording.import = import_options(options);
  recording.read_as = std::move(read_as);
  warn_of_rows_left_out(recording, file.findings);
  take_instrument(recording, name);
  return recording;
}

std::vector<PreparedRecording> read_recordings(const RecordingOptions& options) {
  const ImportOptions import = import_options(options);
  std::vector<PreparedRecording> recordings;
  recordings.reserve(options.files.size());
  for (const std::string& file : options.files) {
    const bool twice = std::any_of(recordings.begin(), recordings.end(),
                                   [&](const auto& r) { return r.name == file; });
    if (twice) {
      throw Error(ExitCode::usage, "FILE", fmt::format("'{}' is given twice", file),
                  "each recording once");
    }
    if (std::filesystem::is_directory(file)) {
      throw bad_input(file, "is a folder",
                      fmt::format("its recordings, such as {}/*.csv", printable(file)));
    }
    recordings.push_back(prepared(file, read_recording_file(file, import), options));
  }
  return recordings;
}

void add_family_option(CLI::App& command, std::string& family, const char* group) {
  command.add_option("--family", family, "Family of laws: classical (default), fractional or all")
      ->check(one_of_words({"classical", "fractional", "all"}))
      ->group(group);
}

std::vector<LawSpec> chosen_laws(const std::vector<std::string>& names, const std::string& family) {
  std::vector<LawSpec> laws;
  laws.reserve(names.size());
  for (const std::string& name : names)
    laws.push_back(of_option([&] { return parse_law_name(name, "--laws"); }));
  if (!laws.empty()) return laws;
  if (family != "fractional") laws = classical_family();
  if (family.empty() || family == "classical") return laws;
  for (const LawSpec& law : fractional_family()) laws.push_back(law);
  return laws;
}

}  // namespace tpm::app
