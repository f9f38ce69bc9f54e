// tpm accuracy: how accurate the program's methods are, and whether it computes what it must.
#include "command.hpp"

namespace tpm::app {

void add_accuracy_command(CLI::App& app, Session& session) {
  CLI::App* command =
      app.add_subcommand("accuracy", "Verification, error against cost, and where step rules fail");
  command->require_subcommand(1);
  add_verify_command(*command, session);
  add_benchmark_command(*command, session);
  add_stability_command(*command, session);
  command->footer("Example:\n  tpm accuracy verify");
}

}  // namespace tpm::app
