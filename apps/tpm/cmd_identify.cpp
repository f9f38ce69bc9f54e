// tpm identify: a recording identified sample by sample, as if it were being made.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "recording_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/online/identification.hpp"
#include "tpm/fit/online/identified_loop.hpp"
#include "tpm/fit/show/identification_report.hpp"
#include "tpm/show/json_table_csv.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::app {
namespace {

struct IdentifyCommand {
  RecordingOptions recordings;
  std::vector<std::string> laws;
  std::string target = "10%", patience = "1.3", level = "0.95", reference, seed = "0";
  std::string folder, output;
  bool no_loop = false, verbose = false;
};

IdentifyOptions identify_options(const IdentifyCommand& command, Quantity drive) {
  IdentifyOptions options;
  for (const std::string& name : command.laws) {
    options.laws.push_back(of_option([&] { return parse_law_name(name, "--laws"); }));
  }
  options.target = parse_share(command.target, "--target");
  options.patience = option_number(command.patience, "--patience");
  options.level = parse_share(command.level, "--level");
  options.seed = parse_whole_number(command.seed, "--seed", 0);
  if (!command.reference.empty()) {
    options.reference =
        option_quantity(command.reference, quantity_dimension(drive), "--reference");
  }
  return options;
}

/// The law in a session; of a strip the law in another program. Without a folder, the command that
/// writes one.
std::string next_of_identify(const IdentifyCommand& command, const LawSpec& law,
                             const Session& session) {
  if (command.folder.empty()) return same_command(session, "--folder identified");
  return next_with_law((std::filesystem::path(command.folder) / "law.json").string(), law);
}

int run_identify(const IdentifyCommand& command, const Session& session) {
  will_write_into(command.folder, {"identification.json", "law.json", "figures.json"});
  const auto csv = csv_beside(command.output, session);
  const PreparedRecording recording = read_recordings(command.recordings).front();
  const Quantity drive = recording.recording.drive_quantity;
  const Identification id = identify(recording, identify_options(command, drive));
  Json json = to_json(id);
  std::string text = to_terminal_text(id);
  ShortAnswer answer = short_answer(id);
  if (!command.no_loop && drive == Quantity::indentation_depth) {
    const IdentifiedLoop loop = replay_in_loop(id, recording, {});
    json["loop"] = to_json(loop);
    text += "\n" + to_terminal_text(loop);
    answer.limits.push_back(loop_words(loop));
  }
  std::vector<std::string> files;
  if (!command.folder.empty()) {
    files = write_identification_report(command.folder, id, identified_law(id, recording), json);
  }
  if (session.json()) {
    Json ended = json;
    add_end(ended, command.folder, files,
            next_of_identify(command, id.laws[id.result().law], session));
    text = answer_text(session, std::move(ended));
  } else if (!command.verbose) {
    end_answer(answer, command.folder, files,
               next_of_identify(command, id.laws[id.result().law], session));
    text = to_text(answer);
  } else if (!files.empty()) {
    text += written(session, command.folder, files);
  }
  deliver(text, command.output);
  deliver_csv(json_table_csv(json.at("history"), "/parameters"), csv);
  return 0;
}

}  // namespace

void add_identify_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand(
      "identify", "Replay a recording and fit it sample by sample, with intervals at each");
  auto options = std::make_shared<IdentifyCommand>();
  command->add_option("RECORDING", options->recordings.files, "A recording of a ramp and hold")
      ->required()
      ->expected(1);
  command->add_option("--laws", options->laws,
                      "Names of laws: choose among these, such as linear-1 power-2 (default: "
                      "linear and power kernels with 0 to 2 branches, and linear-1-elastic)");
  command
      ->add_option("--target", options->target,
                   "Stop when every material parameter is known to this part of its estimate")
      ->capture_default_str();
  command
      ->add_option(
          "--patience", options->patience,
          "Factor by which the number of samples must grow while --target stays met, 1 or more")
      ->capture_default_str();
  command->add_option("--level", options->level, "Confidence level, 0.9 or 90%: of the intervals")
      ->capture_default_str();
  command->add_option(
      "--reference", options->reference,
      "Depth that coefficients refer to: the planned one (default: the recording's)");
  add_seed_option(*command, options->seed, ": the searches")->capture_default_str();
  command->add_flag("--no-loop", options->no_loop,
                    "Do not hand the laws over to a model in the loop");
  add_folder_option(*command, options->folder, ": identification.json, law.json and the figure");
  add_verbose_option(*command, options->verbose, "estimates over time, every hand-over");
  add_output_option(*command, options->output);
  add_recording_options(*command, options->recordings);
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm identify recording.csv --target 5% --folder identified\n"
      "  tpm hil run configs/hil_law.json --law identified/law.json");
  set_run(*command, session, [options, &session] { return run_identify(*options, session); });
}

}  // namespace tpm::app
