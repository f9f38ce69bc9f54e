// tpm validate: a fitted law against recordings that it has not seen.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "command.hpp"
#include "recording_options.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/instrument.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/predict/organ_prediction.hpp"
#include "tpm/fit/show/validation_report.hpp"
#include "tpm/fit/validate/validation.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"

namespace tpm::app {
namespace {

struct ValidateOptions {
  std::string law;
  RecordingOptions recordings;
  std::vector<std::string> quantities;
  std::string requirement, placement = "held", instrument, calibration_instrument, at;
  std::string folder, output;
};

/// The block of a file that holds it alone or under "instrument".
Json instrument_block(const std::string& file) {
  const Json json = read_json(file);
  return json.is_object() && json.contains("instrument") ? json.at("instrument") : json;
}

Instrument instrument_of(const Json& block, const LawSpec& spec, const std::string& where) {
  return read_instrument(block, quantity_dimension(spec.response), quantity_dimension(spec.drive),
                         where + ": instrument");
}

std::optional<Instrument> stated_instrument(const std::string& recording, const std::string& option,
                                            const LawSpec& spec) {
  if (!option.empty()) return instrument_of(instrument_block(option), spec, option);
  const auto block = instrument_beside(recording);
  if (!block) return std::nullopt;
  return instrument_of(*block, spec, recording);
}

LawFile law_to_validate(const std::string& path) {
  if (is_organ_document(read_json(path))) {
    throw bad_input(
        path, "is an organ, which tpm validate does not compare yet",
        "the law.json that was put on it; tpm predict compares an organ with a recording");
  }
  return read_law(path);
}

ValidationRequest request_of(const ValidateOptions& options) {
  ValidationRequest request;
  request.law = law_to_validate(options.law);
  request.law_file = options.law;
  request.law_sha256 = sha256_hex(read_file(options.law));
  const LawSpec& spec = request.law.spec;
  if (!options.requirement.empty()) {
    request.requirement =
        of_option([&] { return parse_requirement(options.requirement, "--require"); });
  }
  request.placement =
      of_option([&] { return parse_placement_rule(options.placement, "--placement"); });
  for (const std::string& text : options.quantities) {
    request.quantities.push_back(
        of_option([&] { return parse_quantity_of_interest(text, spec.drive, "--quantity"); }));
  }
  request.contact_by_threshold = !options.recordings.contact_response.empty();
  if (!options.at.empty()) request.at = options.at;
  request.recordings = read_recordings(options.recordings);
  for (const std::string& file : options.recordings.files) {
    request.instruments.push_back(stated_instrument(file, options.instrument, spec));
  }
  request.calibration = find_calibration(request.law, options.law, [&](const std::string& file) {
    return prepared(file, read_recording_file(file, import_options(options.recordings)),
                    options.recordings);
  });
  if (!options.calibration_instrument.empty()) {
    request.calibration.instrument = instrument_of(instrument_block(options.calibration_instrument),
                                                   spec, options.calibration_instrument);
  }
  return request;
}

int run_validate(const ValidateOptions& options, const Session& session) {
  will_write_into(options.folder, {"validation.csv", "validation.json", "figures.json"});
  const auto csv = csv_beside(options.output, session);
  const ValidationRequest request = request_of(options);
  const Validation validation = validate(request);
  std::string text = session.json() ? to_text(to_json(validation)) : to_terminal_text(validation);
  if (!options.folder.empty()) {
    text += written(session, options.folder,
                    write_validation_report(options.folder, request, validation));
  }
  deliver(text, options.output);
  deliver_csv(to_csv(validation), csv);
  return exit_code(validation.answers_yes());
}

}  // namespace

void add_validate_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "validate",
      "Compare a fitted law with recordings that it has not seen: the model error and its "
      "uncertainty (ASME V&V 20)");
  auto options = std::make_shared<ValidateOptions>();
  command->add_option("LAW", options->law, "law.json that tpm fit has written")->required();
  command
      ->add_option("RECORDING", options->recordings.files,
                   "Recordings that the law was not fitted to, one or more")
      ->required();
  command->add_option("--require", options->requirement,
                      "How large a model error may be: a share of the measured value such as 10%, "
                      "an amount such as \"20 mN\", or jnd (what a hand can tell, as in tpm plan)");
  command
      ->add_option("--quantity", options->quantities,
                   "Quantity to compare: peak, end, ratio, half-time, work, a time such as \"5 s\" "
                   "or a depth such as \"2 mm\" (may be repeated; default: those that the "
                   "recording has)")
      ->allow_extra_args(false);
  command
      ->add_option("--placement", options->placement,
                   "Contact and zero: held (found before contact and at the onset), onset "
                   "(the onset even where the depth starts at 0) or fitted to the recording")
      ->capture_default_str();
  command->add_option("--instrument", options->instrument,
                      "JSON file with the block \"instrument\" of the recordings, where no "
                      "description beside them has it");
  command->add_option("--calibration-instrument", options->calibration_instrument,
                      "The same of the recordings that the law was fitted to");
  command->add_option("--at", options->at,
                      "Recording to whose protocol the pooled area metric is carried, where "
                      "protocols differ");
  command->add_option("--folder", options->folder,
                      "Write validation.csv, validation.json and the figures into this folder");
  add_output_option(*command, options->output);
  add_recording_options(*command, options->recordings);
  add_format_option(*command, session);
  command->footer(
      "Exit code 1 if --require is given and the law is not shown to be adequate.\n"
      "Example:\n  tpm fit recording.csv --folder fitted\n"
      "  tpm validate fitted/law.json other.csv --require 10% --folder validated");
  set_run(*command, session, [options, &session] { return run_validate(*options, session); });
}

}  // namespace tpm::app
