
#include "answer.hpp"
#include "command.hpp"
#include "tpmkit/version.hpp"

namespace tpm::app {

void add_version_command(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("version", "Print the version of tpm");
  add_format_option(*command, session);
  command->footer("Example:\n  tpm version --format json");
  set_run(*command, session, [&session] {
    say("{}",
        session.json() ? answer_text(session, Json::object()) : fmt::format("tpm {}\n", version()));
    return 0;
  });
}

}  // namespace tpm::app
