
#include <memory>

#include "command.hpp"
#include "recording_options.hpp"
#include "tpm/fit/select/selection.hpp"
#include "tpm/fit/show/fit_csv.hpp"

namespace tpm::app {
namespace {

struct SelectOptions {
  RecordingOptions recordings;
  PlacementArguments placement;
  std::vector<std::string> laws;
  std::string family = "classical";
  std::string margin = "3";
  std::string seed = "0";
  std::string output;
  bool no_held_out = false;
  bool no_profiles = false;
};

int select(const SelectOptions& options, const Session& session) {
  SelectionOptions selection;
  selection.laws = chosen_laws(options.laws, options.family);
  selection.only_listed = !options.laws.empty();
  selection.margin = option_number(options.margin, "--margin");
  selection.held_out = !options.no_held_out;
  selection.setup.profiles = !options.no_profiles;
  selection.setup.seed = parse_whole_number(options.seed, "--seed", 0);
  const auto csv = csv_beside(options.output, session);
  const auto recordings = read_recordings(options.recordings);
  hold_placement(options.placement, options.recordings, recordings, selection.setup.contact,
                 selection.setup.zero);
  const Selection result = select_law(recordings, selection);
  std::string text = session.json() ? to_text(to_json(result)) : to_terminal_text(result);
  if (!session.json()) {
    text += "\n" + to_terminal_text(result.candidates[result.recommended].fit);
  }
  deliver(text, options.output);
  deliver_csv(laws_csv(result), csv);
  return 0;
}

}  // namespace

void add_select_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("select", "Find the least law that recordings support, with the evidence");
  auto options = std::make_shared<SelectOptions>();
  command
      ->add_option("FILE", options->recordings.files,
                   "Recordings: machine exports or curves of tpm")
      ->required();
  add_recording_options(*command, options->recordings);
  command->add_option("--laws", options->laws, "Only these laws, e.g. linear-1-elastic,power-2")
      ->delimiter(',');
  add_placement_options(*command, options->placement);
  add_family_option(*command, options->family);
  command
      ->add_option("--margin", options->margin, "BIC that a larger law must gain to be preferred")
      ->capture_default_str();
  command->add_option("--seed", options->seed, "Seed of the random starts")->capture_default_str();
  command->add_flag("--no-held-out", options->no_held_out, "Leave out the held-out predictions");
  command->add_flag("--no-profiles", options->no_profiles,
                    "Leave out the intervals of the recommended law");
  command->add_option("-o,--output", options->output, "Write here instead of to the terminal");
  add_format_option(*command, session);
  command->footer(
      "Example:\n  tpm select meat.csv\n"
      "  tpm select slow.csv fast.csv --laws linear-1,linear-2,power-2 --format json -o laws.json\n"
      "The last one writes its table beside the JSON, too: laws.csv.");
  set_run(*command, session, [options, &session] { return select(*options, session); });
}

}  // namespace tpm::app
