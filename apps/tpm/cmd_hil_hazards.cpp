// tpm hil hazards: what can go wrong in a session, and what becomes of it.

#include <memory>
#include <optional>

#include "command.hpp"
#include "tpm/haptics/show/hazard_report.hpp"
#include "tpm/show/json_table_csv.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {

namespace {

struct HazardChoice {
  std::string output;
  bool wall_clock = false;
};

int try_hazards(const HazardChoice& choice, const Session& session) {
  const auto csv = csv_beside(choice.output, session);
  std::optional<Progress> progress;
  progress.emplace("hazards", choice.wall_clock ? clock_hazard_count() : hazard_count());
  const auto told = [&progress] { progress->advance(); };
  const auto answer = [&](const auto& study, const auto& as_json, const auto& as_text) {
    progress.reset();
    const Json json = as_json(study);
    deliver(session.json() ? to_text(json) : as_text(study), choice.output);
    deliver_csv(json_table_csv(json.at("rows")), csv);
    return exit_code(study.safe());
  };
  if (choice.wall_clock) {
    return answer(study_hazards_on_the_clock(told), clock_hazard_json, clock_hazard_text);
  }
  return answer(study_hazards(told), hazard_json, hazard_text);
}

}  // namespace

void add_hil_hazards_command(CLI::App& hil, Session& session) {
  CLI::App* command = hil.add_subcommand(
      "hazards",
      "What can go wrong in a session, tried on the simulated device; exit code 1 if "
      "force, energy, travel or time leave their bounds");
  auto choice = std::make_shared<HazardChoice>();
  add_output_option(*command, choice->output);
  command->add_flag("--wall-clock", choice->wall_clock,
                    "Those that take time of their own: hangs, stalls, interruptions; half a "
                    "minute, times differ from run to run");
  add_format_option(*command, session);
  command->footer(
      "Examples:\n  tpm hil hazards -o hazards.md\n  tpm hil hazards --wall-clock -o clock.md");
  set_run(*command, session, [choice, &session] { return try_hazards(*choice, session); });
}

}  // namespace tpm::app
