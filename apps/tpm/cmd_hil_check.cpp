// tpm hil check: timing of machine and device before a session, and the gate of that session.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "command.hpp"
#include "common_options.hpp"
#include "hil_options.hpp"
#include "interrupt_watch.hpp"
#include "out_of_memory.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpm/work/progress.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

struct CheckChoice {
  DeviceOptions device;
  std::string session, rate, duration = "60 s";
  bool verbose = false;
};

double within(const std::string& text, Dimension dimension, const char* option, double least,
              double most) {
  const double value = option_quantity(text, dimension, option);
  if (value >= least && value <= most) return value;
  throw Error(ExitCode::usage, option, text,
              fmt::format("{} to {} {}", shortest(least), shortest(most), si_symbol(dimension)));
}

/// Throws Error(usage) for what would not be used: each is refused, not ignored.
void require_used(const CheckChoice& choice, const DeviceChoice& device) {
  if (!choice.session.empty() && !choice.rate.empty()) {
    throw Error(ExitCode::usage, "--loop-rate", "beside a session, which has a rate of its own",
                "\"rate\" in the session, or --loop-rate without one");
  }
  if (choice.session.empty() && device.kind == "virtual" && !device.file.empty()) {
    throw Error(ExitCode::usage, "--device-file", "of a device that no session is asked for",
                "a SESSION, or the --device that the file is of");
  }
}

/// Verdict of `tpm hil run` on the session, up to the first force of the tissue.
SessionVerdict asked_gate(const HilSession& hil, const DeviceChoice& device, RealTimeWish wish) {
  const DeviceLimits limits = limits_of(device);
  if (limits.hardware() && limits.measured_delay_s) {
    tell_user(
        "tpm: let go of the handle in the middle of its workspace: as before a session it is moved "
        "for a second with less than 0.3 N\n");
  }
  std::optional<Progress> progress;
  return ask_session_gate(hil, device, wish, InterruptWatch::seen, [&](const std::string&) {
    if (!progress) progress.emplace("planning the model of the loop", kPlanningSteps);
    progress->advance();
  });
}

JitterCheck checked_hil(const HilSession& hil, const CheckChoice& choice,
                        const DeviceChoice& device, double duration_s) {
  const RealTimeWish wish = chosen_wish(choice.device);
  std::optional<SessionVerdict> verdict;
  if (!choice.session.empty()) verdict = asked_gate(hil, device, wish);
  JitterCheck check =
      check_jitter(device, hil, duration_s, wish, InterruptWatch::seen, warn_of_finding);
  check.session = std::move(verdict);
  return check;
}

/// The session that was asked; without one, the device's delay, or the session that comes with tpm.
/// None where a session would not begin.
std::string next_of_check(const JitterCheck& check, const CheckChoice& choice) {
  if (!check.timing_kept || (check.session && !check.session->accepted)) return {};
  const std::string device = device_arguments(choice.device);
  if (check.session) {
    return fmt::format("tpm hil run {}{} -o session.tpmrec", shell_word(choice.session), device);
  }
  return check.device.hardware && choice.device.file.empty()
             ? fmt::format("tpm hil identify{} -o device.json", device)
             : fmt::format("tpm hil run configs/hil_liver.json{} -o session.tpmrec", device);
}

std::string checked_text(const JitterCheck& check, const CheckChoice& choice) {
  if (choice.verbose) return check_text(check);
  ShortAnswer answer = short_answer(check);
  end_answer(answer, "", {}, next_of_check(check, choice));
  return to_text(answer);
}

int check_hil(const CheckChoice& choice, const Session& session) {
  constexpr double kLeast_Hz = 100.0, kMost_Hz = 4000.0, kLeast_s = 0.1, kMost_s = 86400.0;
  const DeviceChoice device = chosen_device(choice.device);
  require_used(choice, device);
  HilSession hil;
  if (!choice.session.empty()) hil = read_session(choice.session, {}, limits_of(device));
  if (!choice.rate.empty()) {
    hil.servo.period_s =
        1.0 / within(choice.rate, Dimension::frequency, "--loop-rate", kLeast_Hz, kMost_Hz);
  }
  const double duration = within(choice.duration, Dimension::time, "--duration", kLeast_s, kMost_s);
  const InterruptWatch interrupts(InterruptWatch::Of::motors);
  const OutOfMemoryIsThrown while_the_device_is_open;
  JitterCheck check;
  try {
    check = checked_hil(hil, choice, device, duration);
  } catch (const Error& error) {
    if (!InterruptWatch::seen()) throw;
    tell_user("tpm: {}\n", error.what());
    return InterruptWatch::exit_code();
  }
  std::vector<Verdict> verdicts{{"rate_kept", check.timing_kept}};
  if (check.session) verdicts.push_back({"session_accepted", check.session->accepted});
  if (session.json()) {
    Json json = check_json(check);
    add_end(json, {}, {}, next_of_check(check, choice));
    say("{}", answer_text(session, std::move(json), verdicts));
  } else {
    say("{}", checked_text(check, choice));
  }
  if (check.outcome.cause == StopCause::signal) return InterruptWatch::exit_code();
  return exit_code(check.timing_kept && (!check.session || check.session->accepted));
}

}  // namespace

void add_hil_check_command(CLI::App& hil, Session& session) {
  CLI::App* command = hil.add_subcommand(
      "check",
      "Does this machine keep the time with this device, and would a session begin on it?");
  auto choice = std::make_shared<CheckChoice>();
  command->add_option("SESSION", choice->session,
                      "With the rate and the limits of this session, whose start gate is asked too "
                      "(default: timing alone, with the limits of one that says nothing)");
  add_device_options(*command, choice->device);
  command->add_option(
      "--loop-rate", choice->rate,
      "Rate of the servo loop, without a session: 100 Hz to 4 kHz (default: 1 kHz)");
  command->add_option("--duration", choice->duration, "Duration, of the test")
      ->capture_default_str();
  add_verbose_option(*command, choice->verbose, "the distribution of the wake-up latency, too");
  add_format_option(*command, session);
  command->footer(
      "Examples:\n  tpm hil check configs/hil_liver.json --device omega7\n"
      "  tpm hil check --device virtual --loop-rate \"4 kHz\" --duration \"10 s\"");
  set_run(*command, session, [choice, &session] { return check_hil(*choice, session); });
}

}  // namespace tpm::app
