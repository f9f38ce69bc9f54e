// tpm paper: the numbers of a paper, recomputed from its own equations.
#include "command.hpp"

namespace tpm::app {

void add_paper_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("paper", "Recompute a paper: tables, claims, experiments, one report");
  command->require_subcommand(1);
  add_report_command(*command, session);
  add_tables_command(*command, session);
  add_audit_command(*command, session);
  add_experiments_command(*command, session);
  command->footer(
      "Example:\n  tpm paper tables --depths \"2,4,6,8 mm\" --spacings \"20,25,30,35 mm\"");
}

}  // namespace tpm::app
