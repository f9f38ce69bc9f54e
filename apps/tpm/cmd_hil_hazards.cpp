// tpm hil hazards: what can go wrong in a session, and what becomes of it.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "command.hpp"
#include "tpm/core/error.hpp"
#include "tpm/core/progress.hpp"
#include "tpm/report/hazard_report.hpp"

namespace tpm::app {

void add_hil_hazards_command(CLI::App& hil, Session& session) {
  CLI::App* command = hil.add_subcommand(
      "hazards",
      "What can go wrong in a session, tried on the simulated device; exit code 1 if "
      "force, energy, travel or time leave their bounds");
  auto output = std::make_shared<std::string>();
  command->add_option("-o,--output", *output, "File to write instead of the terminal");
  add_format_option(*command, session);
  command->footer("Example:\n  tpm hil hazards -o hazards.md");
  command->callback([output, &session] {
    session.run = [output, &session] {
      std::optional<Progress> progress;
      progress.emplace("hazards", hazard_count());
      const HazardStudy study = study_hazards([&progress] { progress->advance(); });
      progress.reset();
      deliver(session.json() ? to_text(hazard_json(study)) : hazard_text(study), *output);
      return static_cast<int>(study.safe() ? ExitCode::success : ExitCode::answer_is_no);
    };
  });
}

}  // namespace tpm::app
