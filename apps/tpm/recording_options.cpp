#include "recording_options.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "command.hpp"
#include "tpm/files/import/recording_file.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {

void set_quantities(ImportOptions& import, const std::string& drive, const std::string& response,
                    const std::vector<std::string>& units) {
  if (!drive.empty()) import.drive_quantity = reading_options([&] { return parse_quantity_name(drive, "--drive-quantity");
});
if (!response.empty()) {
    import.response_quantity = reading_options([&] { return parse_quantity_name(response, "--response-quantity");
});
}  // namespace tpm::app
for (const std::string& pair : units) {
  const auto equals = pair.rfind('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error(ExitCode::usage, "--unit", fmt::format("'{}' has no '='", printable(pair)),
                "COLUMN=UNIT, such as \"Force=N\"");
  }
  reading_options([&] { return parse_unit(pair.substr(equals + 1), "--unit"); });
  import.units[pair.substr(0, equals)] = pair.substr(equals + 1);
}
}

void add_recording_options(CLI::App& command, RecordingOptions& options) {
  const auto add = options_of_group(command, "What the files do not say");
  add("--time", options.import.time_column, "Column of the times: name, or number from 1");
  add("--drive", options.import.drive_column, "Column of the depth or relative length");
  add("--response", options.import.response_column, "Column of the force or stress");
  add("--sd", options.import.sd_column, "Column of the response's standard deviation");
  add("--frequency", options.import.frequency_column, "Column of the frequency of a spectrum");
  add("--storage", options.import.storage_column, "Column of the storage modulus");
  add("--loss", options.import.loss_column, "Column of the loss modulus");
  add("--drive-quantity", options.drive_quantity, "indentation_depth, strain or relative_length");
  add("--response-quantity", options.response_quantity,
      "contact_force, stress, relaxation_modulus or creep_compliance");
  command
      .add_option("--unit", options.units, "Unit of a column, e.g. \"Force=N\" (may be repeated)")
      ->group("What the files do not say");
  add("--rest-length", options.rest_length,
      "Unloaded length of a stretched specimen, for columns of its length or elongation");
  add("--area", options.area, "Cross section of that specimen, for a column of its force");
  add("--spring-constant", options.spring_constant,
      "JPK force files: of the cantilever, instead of that of the file");
  command
      .add_option("--segments", options.import.segments,
                  "JPK force files: kinds to read, such as extend,pause; default: all")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->group("What the files do not say");
  command
      .add_flag("--negate-drive", options.import.negate_drive,
                "The machine counts the imposed motion negative")
      ->group("What the files do not say");
  command
      .add_flag("--negate-response", options.import.negate_response,
                "The machine counts the force or stress negative")
      ->group("What the files do not say");
  add("--contact-force", options.contact_response,
      "Contact begins where the force passes this, e.g. \"0.05 N\"; default: found");
}

ImportOptions import_options(const RecordingOptions& options) {
  ImportOptions import = options.import;
  set_quantities(import, options.drive_quantity, options.response_quantity, options.units);
  const auto size = [](const std::string& text, Dimension dimension,
                       const char* option) -> std::optional<double> {
    if (text.empty()) return std::nullopt;
    const double value = option_quantity(text, dimension, option);
    if (value > 0.0) return value;
    throw Error(ExitCode::usage, option, fmt::format("'{}'", printable(text)), "a size above 0");
  };
  import.rest_length_m = size(options.rest_length, Dimension::length, "--rest-length");
  import.area_m2 = size(options.area, Dimension::area, "--area");
  import.spring_constant_N_per_m =
      size(options.spring_constant, Dimension::stiffness, "--spring-constant");
  return import;
}

std::vector<PreparedRecording> read_recordings(const RecordingOptions& options) {
  PhaseOptions phases;
  if (!options.contact_response.empty()) {
    phases.contact_response =
        option_quantity(options.contact_response, Dimension::force, "--contact-force");
  }
  const ImportOptions import = import_options(options);
  std::vector<PreparedRecording> recordings;
  recordings.reserve(options.files.size());
  for (const std::string& file : options.files) {
    const bool twice = std::any_of(recordings.begin(), recordings.end(),
                                   [&](const auto& r) { return r.name == file; });
    if (twice) {
      throw Error(ExitCode::usage, "FILE", fmt::format("'{}' is given twice", printable(file)),
                  "each recording once");
    }
    RecordingFile read = read_recording_file(file, import);
    std::string read_as = columns_words(read.findings);
    recordings.push_back(prepare_recording(file, std::move(read.recording), phases));
    recordings.back().import = import;
    recordings.back().read_as = std::move(read_as);
  }
  return recordings;
}

void add_family_option(CLI::App& command, std::string& family) {
  command.add_option("--family", family, "classical, fractional or all")
      ->check(CLI::IsMember({"classical", "fractional", "all"}))
      ->capture_default_str();
}

std::vector<LawSpec> chosen_laws(const std::vector<std::string>& names, const std::string& family) {
  std::vector<LawSpec> laws;
  laws.reserve(names.size());
  for (const std::string& name : names)
    laws.push_back(reading_options([&] { return parse_law_name(name, "--laws"); }));
  if (!laws.empty()) return laws;
  if (family != "fractional") laws = classical_family();
  if (family == "classical") return laws;
  for (const LawSpec& law : fractional_family()) laws.push_back(law);
  return laws;
}

}  // namespace tpm::app
