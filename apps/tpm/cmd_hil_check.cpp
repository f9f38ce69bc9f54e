// tpm hil check: communication and jitter test before a session.
#include <fmt/format.h>

#include <memory>

#include "answer.hpp"
#include "command.hpp"
#include "hil_options.hpp"
#include "interrupt_watch.hpp"
#include "out_of_memory.hpp"
#include "tpm/base/text.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

struct CheckChoice {
  DeviceOptions device;
  std::string session, rate, duration = "60 s";
};

double within(const std::string& text, Dimension dimension, const char* option, double least,
              double most) {
  const double value = option_quantity(text, dimension, option);
  if (value >= least && value <= most) return value;
  throw Error(ExitCode::usage, option, text,
              fmt::format("{} to {} {}", shortest(least), shortest(most), si_symbol(dimension)));
}

int check_hil(const CheckChoice& choice, const Session& session) {
  constexpr double kLeast_Hz = 100.0, kMost_Hz = 4000.0, kLeast_s = 0.1, kMost_s = 86400.0;
  HilSession hil;
  if (!choice.session.empty()) hil = read_session(choice.session);
  if (!choice.rate.empty()) {
    hil.servo.period_s =
        1.0 / within(choice.rate, Dimension::frequency, "--loop-rate", kLeast_Hz, kMost_Hz);
  }
  const double duration = within(choice.duration, Dimension::time, "--duration", kLeast_s, kMost_s);
  const InterruptWatch interrupts(InterruptWatch::Of::motors);
  const OutOfMemoryIsThrown while_the_device_is_open;
  const JitterCheck check = check_jitter(chosen_device(choice.device), hil, duration,
                                         chosen_wish(choice.device), InterruptWatch::seen);
  say("{}", session.json() ? answer_text(session, check_json(check), {{"rate_kept", check.fit}})
                           : check_text(check));
  return exit_code(check.fit);
}

}  // namespace

void add_hil_check_command(CLI::App& hil, Session& session) {
  CLI::App* command = hil.add_subcommand(
      "check", "Is this machine, with this device, up to a session? Jitter, verdict");
  auto choice = std::make_shared<CheckChoice>();
  command->add_option("SESSION", choice->session,
                      "With the rate and the limits of this session (default: those of one that "
                      "says nothing)");
  add_device_options(*command, choice->device);
  command->add_option("--loop-rate", choice->rate,
                      "Rate of the servo loop, 100 Hz to 4 kHz (default: the session's, 1 kHz)");
  command->add_option("--duration", choice->duration, "Duration, of the test")
      ->capture_default_str();
  add_format_option(*command, session);
  command->footer(
      "Examples:\n  tpm hil check configs/hil_liver.json --device omega7\n"
      "  tpm hil check --device virtual --loop-rate \"4 kHz\" --duration \"10 s\"");
  set_run(*command, session, [choice, &session] { return check_hil(*choice, session); });
}

}  // namespace tpm::app
