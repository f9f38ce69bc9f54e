// tpm hil devices, tpm hil run: a session through a haptic device.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "hil_options.hpp"
#include "hil_page.hpp"
#include "interrupt_watch.hpp"
#include "option_kinds.hpp"
#include "out_of_memory.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/device/force_dimension.hpp"
#include "tpm/haptics/device/plugin_device.hpp"
#include "tpm/haptics/session/enter_key.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

struct RunChoice {
  std::string session;
  DeviceOptions device;
  std::string time;
  std::string output = "session.tpmrec";
  SessionChanges changes;
  SessionNotes notes;
  bool accept_unstable = false;
  PageOptions page;
};

Json seen_json(const SeenDevice& device) {
  const bool known = !device.kind.empty();
  return {{"index", device.index},
          {"type", device.type},
          {"device", known ? Json(device.kind) : Json()},
          {"name", device.name},
          {"serial", device.serial < 0 ? Json() : Json(device.serial)},
          {"simulated_device", device.simulated},
          {"tried", known && limits_of(device.kind).tried},
          {"problem", device.problem}};
}

std::string seen_text(const SeenDevice& device) {
  if (!device.problem.empty()) {
    return fmt::format("{:<8} cannot be opened: {}\n", device.index, device.problem);
  }
  const char* simulated = device.simulated ? ", SIMULATED DEVICE" : "";
  if (device.kind.empty()) {
    return fmt::format("{:<8} {}{}, type {}, serial {}: no --device of tpm\n", device.index,
                       device.name, simulated, device.type, device.serial);
  }
  return fmt::format("{:<8} {}{}, serial {}: --device {} --serial {}{}\n", device.index,
                     device.name, simulated, device.serial, device.kind, device.serial,
                     limits_of(device.kind).tried ? "" : " (never tried with this device)");
}

/// Lists the devices of a plugin; opens none.
int list_plugin(const DeviceOptions& options, const Session& session) {
  const DevicePlugin plugin(options.plugin);
  Json list = Json::array();
  std::string text = fmt::format("{}: {}\n", plugin.file(), plugin.name());
  for (const SeenDevice& device : seen_devices(plugin)) {
    if (!device.problem.empty()) {
      list.push_back({{"index", device.index}, {"problem", device.problem}});
      text += fmt::format("{:<8} {}\n", device.index, device.problem);
      continue;
    }
    const tpm_device_description said = plugin.describe(device.index);
    const tpm_device_limits& limits = said.limits;
    const bool hardware = said.hardware != 0;
    list.push_back({{"index", device.index},
                    {"name", device.name},
                    {"serial", device.serial < 0 ? Json() : Json(device.serial)},
                    {"simulated_device", !hardware},
                    {"force_N", limits.force_N},
                    {"reach_m", limits.reach_m},
                    {"stiffness_N_per_m", limits.stiffness_N_per_m},
                    {"damping_N_s_per_m", limits.damping_N_s_per_m},
                    {"slew_N_per_s", limits.slew_N_per_s},
                    {"least_ramp_in_s", limits.least_ramp_in_s},
                    {"friction_N_s_per_m", limits.friction_N_s_per_m},
                    {"delay_periods", limits.delay_periods}});
    text += fmt::format(
        "{:<8} {}{}: --device plugin --index {}\n"
        "         at most {} N, {} mm from the centre, {} N/m; friction {} N s/m, {} periods "
        "late\n",
        device.index, device.name, hardware ? "" : ", SIMULATED DEVICE", device.index,
        limits.force_N, 1e3 * limits.reach_m, limits.stiffness_N_per_m, limits.friction_N_s_per_m,
        limits.delay_periods);
  }
  if (list.empty()) text += "none     the plugin is there, and sees no device\n";
  const Json json{
      {"plugin", {{"file", plugin.file()}, {"name", plugin.name()}, {"devices", list}}}};
  say("{}", session.json() ? answer_text(session, json) : text);
  return 0;
}

/// The devices of a service that is compatible with the Inverse service, or why there are none.
std::pair<Json, std::string> listed_inverse(const InverseAddress& address) {
  Json list = Json::array();
  std::string text, reason, unheard;
  try {
    for (const InverseDeviceEntry& device : inverse_inventory(address).devices) {
      list.push_back({{"id", device.id},
                      {"type", device.type},
                      {"simulated_device", device.simulated},
                      {"in_use", device.in_use}});
      text += fmt::format("{:<8} {} at port {}{}{}: --device inverse3 --serial {}\n",
                          list.size() - 1, printable(device.type.empty() ? "device" : device.type),
                          address.port, device.simulated ? ", SIMULATED DEVICE" : "",
                          device.in_use ? ", in use" : "", printable(device.id));
    }
    if (list.empty()) reason = fmt::format("the service at port {} sees no device", address.port);
    unheard = inverse_events_fault(address);
    if (!unheard.empty()) text += fmt::format("         no session begins: events: {}\n", unheard);
  } catch (const Error& error) {
    reason = error.what();
  }
  if (!reason.empty()) text = fmt::format("none     of Haply: {}\n", reason);
  return {Json{{"port", address.port},
               {"devices", list},
               {"reason", reason},
               {"events_port", address.events_port},
               {"events_reason", unheard}},
          text};
}

int list_devices(const DeviceOptions& options, const Session& session) {
  require_libraries(options);
  if (!options.plugin.empty()) return list_plugin(options, session);
  std::vector<SeenDevice> devices;
  std::string reason;
  try {
    devices = seen_devices(options.library);
    if (devices.empty()) reason = "the library is there, and sees no device";
  } catch (const Error& error) {
    if (error.code() != ExitCode::environment) throw;
    reason = error.what();
  }
  Json list = Json::array();
  std::string text;
  for (const SeenDevice& device : devices) {
    list.push_back(seen_json(device));
    text += seen_text(device);
  }
  const auto [inverse, inverse_text] = listed_inverse(options.choice.inverse);
  if (session.json()) {
    say("{}",
        answer_text(session, Json{{"force_dimension", {{"devices", list}, {"reason", reason}}},
                                  {"inverse3", inverse},
                                  {"virtual", {{"available", true}, {"simulated_device", true}}},
                                  {"replay", {{"available", true}, {"simulated_device", true}}}}));
    return 0;
  }
  if (devices.empty()) text = fmt::format("none     of Force Dimension: {}\n", reason);
  say("{}{}virtual  always there: a simulated Omega.7 and operator, no hardware\n"
      "replay   always there: the motion of a recording, no hardware\n",
      text, inverse_text);
  return 0;
}

/// Sees a signal, and Enter where tpm runs in a terminal.
std::function<bool()> watched_keys(HilSession& session, SessionRunOptions& options) {
  if (!options.real_time || ::isatty(STDIN_FILENO) == 0) return InterruptWatch::seen;
  return [look = watch_enter(STDIN_FILENO, session, options)] {
    look();
    return InterruptWatch::seen();
  };
}

/// Throws Error(usage) for a text that does not fit into a line of a report.
void require_short(const std::string& text, const char* option) {
  constexpr std::size_t kMost = 64;
  if (text.size() <= kMost && printable(text) == text) return;
  throw Error(ExitCode::usage, option, "'" + printable(text, kMost) + "'",
              fmt::format("at most {} printable characters", kMost));
}

/// Tells how far the planning of a model is, and then the operator what to do or how far a
/// simulated session is.
class Guide {
 public:
  Guide(const HilSession& session, bool real_time) : session_(session), real_time_(real_time) {}
  void plan() {
    if (!progress_) progress_.emplace("planning the model of the loop", kPlanningSteps);
    progress_->advance();
  }
  void begin() {
    progress_.reset();
    if (!real_time_) progress_.emplace("session", session_.phases.size());
  }
  void see(const ServoRecord& row) {
    if (row.phase < 0) return wait(row);
    if (row.phase == phase_ || row.phase >= static_cast<std::int32_t>(session_.phases.size()))
      return;
    phase_ = row.phase;
    if (progress_) progress_->advance();
    if (!real_time_ || isatty(STDERR_FILENO) == 0) return;
    tell_user("{:8.1f} s  {}\n", static_cast<double>(row.cycle) * session_.servo.period_s,
              session_.phases[static_cast<std::size_t>(phase_)].name);
  }

 private:
  /// Says what is missing before the session can begin, once for each thing.
  void wait(const ServoRecord& row) {
    const std::uint32_t missing = row.flags & (kOutOfReach | kInTissue | kMoving | kUnconfirmed);
    if (missing == missing_ || row.stop != StopCause::none) return;
    missing_ = missing;
    if (real_time_ || (missing & ~kMoving) != 0) tell_user("tpm: {}\n", instruction_of(row));
  }

  const HilSession& session_;
  bool real_time_;
  std::int32_t phase_ = -1;
  std::uint32_t missing_ = 0;
  std::optional<Progress> progress_;
};

void warn_if_beyond_model(const ServoOutcome& outcome) {
  if (outcome.counts.beyond_model == 0) return;
  tell_user(
      "tpm: warning: beyond the range that the model is good for in {} of {} cycles; tpm hil "
      "report says from when on\n",
      outcome.counts.beyond_model, outcome.cycles);
}

int exit_code_of(const ServoOutcome& outcome) {
  if (outcome.cause == StopCause::finished) return 0;
  if (outcome.cause == StopCause::signal) return InterruptWatch::exit_code();
  tell_user("tpm: session stopped: {}{}{}\n", to_string(outcome.cause),
            outcome.detail.empty() ? "" : ": ", outcome.detail);
  return static_cast<int>(ExitCode::environment);
}

SessionRunOptions run_options(const RunChoice& choice, bool hardware) {
  SessionRunOptions options;
  // A page is for somebody who watches.
  options.real_time =
      choice.time.empty() ? hardware || !choice.page.port.empty() : choice.time == "real";
  options.notes = choice.notes;
  require_short(choice.notes.date, "--date");
  require_short(choice.notes.operator_code, "--operator");
  require_short(choice.notes.subject_code, "--subject");
  // A simulated recording has the same bytes each time.
  if (hardware && options.notes.date.empty()) options.notes.date = utc_now();
  options.wish = chosen_wish(choice.device);
  options.recording = choice.output;
  options.accept_unstable = choice.accept_unstable;
  return options;
}

int run_hil(const RunChoice& choice, const Session& session) {
  require_new(choice.output, session);
  DeviceChoice device = chosen_device(choice.device);
  if (!choice.changes.motion.empty() && device.kind == "virtual") device.kind = "replay";
  const DeviceLimits limits = limits_of(device);
  HilSession hil = read_session(choice.session, choice.changes, limits);
  SessionRunOptions options = run_options(choice, limits.hardware());
  if (device.kind == "virtual" && options.real_time) forgive_stalls(hil);
  const InterruptWatch interrupts(InterruptWatch::Of::motors);
  options.interrupted = watched_keys(hil, options);
  std::optional<HilPage> page;
  if (!choice.page.port.empty()) {
    page.emplace(hil, options.real_time, choice.page);
    page->show(options);
  }
  auto guide = std::make_unique<Guide>(hil, options.real_time);
  options.watcher = [&guide, &page](const ServoRecord& row) {
    guide->see(row);
    if (page) page->see(row);
  };
  options.planning = [&guide](const std::string&) { guide->plan(); };
  options.checking = [](double most_N) {
    tell_user(
        "tpm: hold the tool still in the middle of its workspace, or let go of it: once it is at "
        "rest it is pushed for a second with at most {} N, which measures its delay\n",
        most_N);
  };
  options.noticed = warn_of_finding;
  std::optional<OutOfMemoryIsThrown> while_the_device_is_open;
  options.opened = [&, opened = options.opened](const DeviceIdentity& identity,
                                                const LoopModel& model) {
    while_the_device_is_open.emplace();
    guide->begin();
    if (opened) opened(identity, model);
  };
  SessionRun run;
  try {
    run = run_session(hil, device, options);
  } catch (const Error& error) {
    if (!InterruptWatch::seen()) throw;
    tell_user("tpm: {}\n", error.what());
    return InterruptWatch::exit_code();
  }
  guide.reset();
  const std::string next = run.outcome.cause == StopCause::finished
                               ? "tpm hil verify " + shell_word(choice.output)
                               : std::string();
  if (session.json()) {
    Json json = run_json(hil, run);
    json["recording"] = choice.output;
    add_end(json, {}, {choice.output}, next);
    say("{}", answer_text(session, std::move(json)));
  } else {
    say("{}wrote {}\n", run_text(hil, run), choice.output);
    say("{}", next_line(next));
  }
  for (const Remark& remark : run.rendering.remarks) {
    tell_user("tpm: warning: {}\n", remark.text);
  }
  warn_if_beyond_model(run.outcome);
  if (page) page->end(run.outcome, options.interrupted);
  return exit_code_of(run.outcome);
}

void add_devices_command(CLI::App& hil, Session& session) {
  CLI::App* devices = hil.add_subcommand("devices", "What devices are there, and why one is not");
  auto listed = std::make_shared<DeviceOptions>();
  add_dhd_library(*devices, *listed);
  devices->add_option("--plugin", listed->plugin,
                      "Library of a device plugin: list its devices (docs/library.md)");
  add_inverse_ports(*devices, *listed);
  add_format_option(*devices, session);
  devices->footer("Examples:\n  tpm hil devices\n  tpm hil devices --plugin ./my_device.so");
  set_run(*devices, session, [listed, &session] { return list_devices(*listed, session); });
}

void add_run_command(CLI::App& hil, Session& session) {
  CLI::App* run = hil.add_subcommand("run", "Run a session and record it");
  auto choice = std::make_shared<RunChoice>();
  add_session_argument(*run, choice->session);
  add_device_options(*run, choice->device);
  run->add_option("--clock", choice->time,
                  "Clock of the run: real, or virtual: as fast as it goes, the same bits each time "
                  "(default: real with a real device or a page, else virtual)")
      ->check(one_of_words({"real", "virtual"}));
  run->add_option("-o,--output", choice->output, "File to write (the recording, .tpmrec)")
      ->capture_default_str();
  run->add_option("--law", choice->changes.law,
                  "Feel this law instead of the session's tissue (tpm fit writes law.json)");
  run->add_option("--replay-motion", choice->changes.motion,
                  "Go through the motion of this recording of a depth instead of the session's "
                  "phases; with --device omega7 the operator is asked to");
  run->add_option("--date", choice->notes.date,
                  "Date of the session, stands in the recording; default with a real device: now");
  run->add_option("--operator", choice->notes.operator_code,
                  "Code of who runs the session; stands in the recording");
  run->add_option("--subject", choice->notes.subject_code,
                  "Code of who holds the device; stands in the recording");
  run->add_flag("--overwrite", session.force, "Replace files that exist");
  run->add_flag("--accept-unstable", choice->accept_unstable,
                "Run what would be unstable, on the virtual device only");
  run->add_option(
      "--page", choice->page.port,
      "Port of a page that a browser on this machine shows: the session; 0 for one that is free");
  run->add_option("--page-wait", choice->page.wait,
                  "Begin when the page has been opened, or after so long")
      ->capture_default_str();
  run->add_option("--page-keep", choice->page.keep,
                  "Keep a page that is open for so long after the end")
      ->capture_default_str();
  add_format_option(*run, session);
  run->footer(
      "Examples:\n  tpm hil run configs/hil_omega7.json --device virtual -o session.tpmrec\n"
      "  tpm fit recording.csv --folder fitted && tpm hil run configs/hil_law.json --law "
      "fitted/law.json -o law.tpmrec\n"
      "  tpm hil run configs/hil_inverse3.json --device inverse3 --device-file inverse.json");
  set_run(*run, session, [choice, &session] { return run_hil(*choice, session); });
}

}  // namespace

void add_hil_command(CLI::App& app, Session& session) {
  CLI::App* hil = app.add_subcommand("hil", "A tissue rendered on a haptic device");
  hil->require_subcommand(1);
  hil->footer(
      "Example:\n  tpm hil devices\n  tpm hil run configs/hil_liver.json -o liver.tpmrec\n"
      "  tpm hil verify liver.tpmrec");
  add_devices_command(*hil, session);
  add_run_command(*hil, session);
  add_hil_serve_command(*hil, session);
  add_hil_check_command(*hil, session);
  add_hil_identify_command(*hil, session);
  add_hil_verify_commands(*hil, session);
  add_hil_export_command(*hil, session);
  add_hil_stability_command(*hil, session);
}

}  // namespace tpm::app
