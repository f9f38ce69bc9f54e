// tpm hil serve: a simulated device behind the messages of the Inverse service.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "hil_options.hpp"
#include "hil_page.hpp"
#include "interrupt_watch.hpp"
#include "tpm/haptics/serve/serve.hpp"
#include "tpm/haptics/session/live_view.hpp"
#include "tpm/haptics/session/page_server.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

struct ServeChoice {
  std::string session, port = "10001", events_port = "10020", duration, page;
  bool poll = false;
};

double serve_duration_s(const std::string& text) {
  constexpr double kMost_s = 86400.0;
  if (text.empty()) return 0.0;
  const double duration_s = option_quantity(text, Dimension::time, "--duration");
  if (duration_s > 0.0 && duration_s <= kMost_s) return duration_s;
  throw Error(ExitCode::usage, "--duration", text, "above 0, at most 86400 s");
}

int serve_hil(const ServeChoice& choice, const Session& session) {
  ServeOptions options;
  options.port = listening_port(choice.port, "--port");
  options.events_port = listening_port(choice.events_port, "--events-port");
  if (options.port != 0 && options.events_port == options.port) {
    throw Error(ExitCode::usage, "--events-port", choice.events_port, "another port than --port");
  }
  options.duration_s = serve_duration_s(choice.duration);
  options.poll = choice.poll;
  const HilSession hil = read_session(choice.session);
  LiveView view(hil, true);
  std::optional<PageServer> page;
  if (!choice.page.empty()) page.emplace(view, listening_port(choice.page, "--page"));
  const InterruptWatch interrupts;
  options.interrupted = InterruptWatch::seen;
  options.log = [](const std::string& line) { tell_user("tpm: {}\n", line); };
  options.opened = [&](const InverseServer& server, const DeviceIdentity& identity,
                       const LoopModel& model) {
    view.opened(identity, model);
    tell_user("SIMULATED DEVICE at ws://localhost:{}, events at ws://localhost:{}\n", server.port(),
              server.events_port());
    tell_user("hand: http://127.0.0.1:{}/\n", server.port());
    if (page) tell_user("page: {}\n", page->address());
  };
  options.watcher = [&view](const ServoRecord& row) { view.see(row); };
  const ServeRun run = serve_session(hil, options);
  view.ended(run.outcome);
  say("{}", session.json() ? answer_text(session, serve_json(hil, run)) : serve_text(hil, run));
  // Ctrl-C is how a server ends; one that has a duration may end before it.
  const bool ended =
      run.outcome.cause == StopCause::finished || run.outcome.cause == StopCause::signal;
  return ended ? 0 : static_cast<int>(ExitCode::environment);
}

}  // namespace

void add_hil_serve_command(CLI::App& hil, Session& session) {
  CLI::App* command = hil.add_subcommand(
      "serve", "A simulated device and a tissue, for clients of the Inverse service");
  auto choice = std::make_shared<ServeChoice>();
  add_session_argument(*command, choice->session);
  command
      ->add_option("--port", choice->port, "Port of the simulation channel, 0 for one that is free")
      ->capture_default_str();
  command
      ->add_option("--events-port", choice->events_port,
                   "Port of the events, 0 for one that is free")
      ->capture_default_str();
  command->add_option("--duration", choice->duration, "Duration, at most (default: until Ctrl-C)");
  command->add_option(
      "--page", choice->page,
      "Port of a page that a browser on this machine shows: the tissue; 0 for one that is free");
  command->add_flag("--poll", choice->poll,
                    "Never sleep between messages: faster answers, one processor busy");
  add_format_option(*command, session);
  command->footer(
      "Examples:\n  tpm hil serve configs/hil_omega7.json\n"
      "  tpm hil serve configs/hil_omega7.json --port 0 --events-port 0 --duration \"2 s\"");
  set_run(*command, session, [choice, &session] { return serve_hil(*choice, session); });
}

}  // namespace tpm::app
