// tpm budget: what is lost between a recording and a hand.
#include <fmt/format.h>

#include <filesystem>

#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "protocol_options.hpp"
#include "recording_options.hpp"
#include "tpm/base/text.hpp"
#include "tpm/fit/predict/error_budget.hpp"
#include "tpm/fit/show/budget_report.hpp"
#include "tpm/organ/scene/experiment_scene.hpp"
#include "tpm/show/short_answer.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/law_file.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

struct BudgetCommand {
  std::string law;
  RecordingOptions recordings;  ///< its file may also hold a protocol
  PlacementArguments held;
  RampOptions ramp;
  std::string scene, finer, tolerance = "1%";
  std::string loop_rate = "1 kHz", encoder = "10 um", delay = "1", samples = "1000", seed = "0";
  std::string folder, output;
  bool verbose = false;
};

BudgetOptions budget_options(const BudgetCommand& command) {
  BudgetOptions options;
  const double rate = option_quantity(command.loop_rate, Dimension::frequency, "--loop-rate");
  if (!(rate >= 1.0 && rate <= 1e6)) {
    throw Error(ExitCode::usage, "--loop-rate", "'" + printable(command.loop_rate) + "'",
                "1 Hz to 1 MHz");
  }
  options.device.period_s = 1.0 / rate;
  options.device.encoder_step_m = option_quantity(command.encoder, Dimension::length, "--encoder");
  if (!(options.device.encoder_step_m >= 0.0)) {
    throw Error(ExitCode::usage, "--encoder", "'" + printable(command.encoder) + "'", "0 or more");
  }
  options.device.delay_periods = static_cast<int>(parse_whole_number(command.delay, "--delay", 0));
  constexpr std::uint64_t kFewest = 100;
  options.samples = static_cast<int>(parse_whole_number(command.samples, "--draws", kFewest));
  options.seed = parse_whole_number(command.seed, "--seed", 0);
  return options;
}

/// An organ's protocol is its scene's, unless another is given.
ErrorBudget budget_of_organ(const BudgetCommand& command, const LawFile& law) {
  require_nothing_held(command.held);
  ExperimentScene scene = read_experiment(command.scene);
  const bool other = !command.ramp.depth.empty() || !command.ramp.rate.empty() ||
                     !command.ramp.hold.empty() || !command.recordings.files.empty();
  if (other) {
    auto file = chosen_protocol(command.ramp, command.recordings.files);
    if (!file) {
      throw Error(ExitCode::usage, "RECORDING", "with --scene",
                  "a protocol: an organ's budget follows one");
    }
    scene.protocol = std::move(file->protocol);
  }
  std::optional<ExperimentScene> finer;
  if (!command.finer.empty()) finer = read_experiment(command.finer);
  return organ_budget(law, scene, finer, command.tolerance, budget_options(command));
}

ErrorBudget budget_of_contact(const BudgetCommand& command, const LawFile& law) {
  if (!command.finer.empty()) {
    throw Error(ExitCode::usage, "--finer", "without --scene", "both, or none");
  }
  BudgetOptions options = budget_options(command);
  const auto file = chosen_protocol(command.ramp, command.recordings.files);
  if (file) {
    require_nothing_held(command.held);
    return contact_budget(law, file->protocol, file->times_s, options);
  }
  const std::vector<PreparedRecording> recordings = read_recordings(command.recordings);
  hold_placement(command.held, command.recordings, recordings, options.contact, options.zero);
  return contact_budget(law, recordings.front(), options);
}

/// A plan whose tolerance is the data uncertainty, of a scene that comes with tpm where none was
/// given; without a folder, the command that writes one.
std::string next_of_budget(const BudgetCommand& command, const Session& session) {
  if (command.folder.empty()) return same_command(session, "--folder budget");
  constexpr const char* kShipped = "configs/plan/servo.json";
  return fmt::format("tpm plan {} --tolerance data --budget-file {}",
                     shell_word(command.scene.empty() ? kShipped : command.scene),
                     shell_word((std::filesystem::path(command.folder) / "budget.json").string()));
}

int run_budget(const BudgetCommand& command, const Session& session) {
  will_write_into(command.folder, {"budget.json", "budget.csv", "figures.json"});
  const auto csv = csv_beside(command.output, session);
  const LawFile law = read_law(command.law);
  const ErrorBudget budget =
      command.scene.empty() ? budget_of_contact(command, law) : budget_of_organ(command, law);
  std::vector<std::string> files;
  if (!command.folder.empty()) files = write_budget_report(command.folder, budget);
  std::string text;
  if (session.json()) {
    Json json = to_json(budget);
    add_end(json, command.folder, files, next_of_budget(command, session));
    text = answer_text(session, std::move(json));
  } else if (command.verbose) {
    text = to_terminal_text(budget);
    if (!files.empty()) text += written(session, command.folder, files);
  } else {
    ShortAnswer answer = short_answer(budget);
    end_answer(answer, command.folder, files, next_of_budget(command, session));
    text = to_text(answer);
  }
  deliver(text, command.output);
  deliver_csv(to_csv(budget), csv);
  return 0;
}

}  // namespace

void add_budget_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("budget", "What is lost between a recording and a hand, stage by stage");
  auto options = std::make_shared<BudgetCommand>();
  add_fitted_law(*command, options->law);
  command
      ->add_option("PROTOCOL|RECORDING", options->recordings.files,
                   "A JSON file with a block protocol, or a recording: its motion, and its "
                   "readings as the first stage")
      ->expected(0, 1);
  add_ramp_options(*command, options->ramp);
  command->add_option(
      "--scene", options->scene,
      "An organ (JSON scene) that stands for the contact: its own stages follow the "
      "law, along its protocol");
  command->add_option("--finer", options->finer,
                      "Organ at a finer spacing, else the same: adds the line spacing");
  command
      ->add_option("--tolerance", options->tolerance,
                   "Largest error of the model, with --scene: of the one that is picked for the "
                   "loop, as tpm plan takes it")
      ->capture_default_str();
  command->add_option("--loop-rate", options->loop_rate, "Rate of the servo loop")
      ->capture_default_str();
  command->add_option("--encoder", options->encoder, "Step of the position, 0 m for none")
      ->capture_default_str();
  command->add_option("--delay", options->delay, "Periods from a position to its force")
      ->capture_default_str();
  add_draws_option(*command, options->samples, "for the random part")->capture_default_str();
  add_seed_option(*command, options->seed, ": the draws")->capture_default_str();
  add_folder_option(*command, options->folder, ": budget.json, budget.csv and the waterfall");
  add_verbose_option(*command, options->verbose, "from which stage to which, what a hand can feel");
  add_output_option(*command, options->output);
  add_recording_options(*command, options->recordings);
  add_placement_options(*command, options->held);
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm fit recording.csv --folder fitted\n"
      "  tpm budget fitted/law.json recording.csv --folder budget\n"
      "  tpm plan configs/plan/servo.json --tolerance data --budget-file budget/budget.json");
  set_run(*command, session, [options, &session] { return run_budget(*options, session); });
}

}  // namespace tpm::app
