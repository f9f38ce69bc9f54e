// tpm hil identify: delay, friction and mass of a device, measured with small forces.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>

#include "answer.hpp"
#include "command.hpp"
#include "hil_options.hpp"
#include "interrupt_watch.hpp"
#include "option_kinds.hpp"
#include "out_of_memory.hpp"
#include "tpm/base/text.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/identify_run.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::app {
namespace {

struct IdentifyChoice {
  DeviceOptions device;
  std::string session, rate, duration = "20 s", time, output = "device.json";
};

double between(const std::string& text, Dimension dimension, const char* option, double least,
               double most) {
  const double value = parse_quantity(text, dimension, option);
  if (value >= least && value <= most) return value;
  throw Error(ExitCode::usage, option, text,
              fmt::format("{} to {} {}", shortest(least), shortest(most), si_symbol(dimension)));
}

std::string identified_text(const IdentifyRun& run) {
  const DeviceIdentification& f = run.found;
  std::string text =
      fmt::format("{}{}\n", run.device.name, run.device.hardware ? "" : ", SIMULATED DEVICE");
  if (f.delay_mean_s) {
    text += fmt::format(
        "delay       {} ms in the mean, {} ms at most, spread {} ms, known to {} ms ({} edges of "
        "the force); both paths together, without the hold of a command\n",
        significant(1e3 * *f.delay_mean_s, 3), significant(1e3 * *f.delay_largest_s, 3),
        significant(1e3 * *f.delay_jitter_s, 2), significant(1e3 * f.resolution_s, 2), f.edges);
  }
  if (f.viscous_lower_95_N_s_per_m && f.coulomb_low_N) {
    text += fmt::format(
        "friction    viscous above {} N s/m with 95 % (estimate {}), Coulomb {} to {} N\n",
        significant(*f.viscous_lower_95_N_s_per_m, 3), significant(*f.viscous_N_s_per_m, 3),
        significant(*f.coulomb_low_N, 2), significant(*f.coulomb_high_N, 2));
  }
  if (f.mass_kg) {
    text += f.mass_certain
                ? fmt::format("mass        {} kg\n", significant(*f.mass_kg, 3))
                : fmt::format(
                      "mass        {} to {} kg (a hand holds the handle, friction or the "
                      "encoder does not allow more)\n",
                      significant(*f.mass_low_kg, 3), significant(*f.mass_high_kg, 3));
  }
  if (f.encoder_step_m) {
    text += fmt::format("encoder     step {} um, noise {} um\n",
                        significant(1e6 * *f.encoder_step_m, 3), significant(1e6 * f.noise_m, 2));
  }
  if (f.stalls > 0) {
    text +=
        fmt::format("left out    {} {} in which loop or device stalled, {} s in all{}\n", f.stalls,
                    f.stalls == 1 ? "stretch" : "stretches", significant(f.stalled_s, 2),
                    run.begun_again == 0 ? std::string()
                                         : fmt::format("; begun again {} {}", run.begun_again,
                                                       run.begun_again == 1 ? "time" : "times"));
  }
  for (const DeviceFinding& finding : run.findings) {
    text += "the device noticed: " + finding.text + "\n";
  }
  for (const Remark& remark : f.not_identified) {
    text += fmt::format("not identified: {}\n", remark.text);
  }
  return text;
}

/// Says what the measurement waits for, once for each thing, and when it begins.
class StartWords {
 public:
  StartWords(const DeviceLimits& limits, bool real_time) : limits_(limits), real_time_(real_time) {}
  void see(const ServoRecord& row) {
    if (row.stop != StopCause::none) return;
    const std::uint32_t missing = row.phase < 0 ? row.flags & (kOutOfReach | kMoving) : 0U;
    if (missing == missing_) return;
    missing_ = missing;
    if ((missing & kOutOfReach) != 0) {
      const Eigen::Map<const Eigen::Vector3d> at_m(row.position_m);
      tell_user(
          "tpm: waiting: the handle is {} mm from the middle of its workspace; bring it to within "
          "{} mm and let go\n",
          significant(1e3 * at_m.norm(), 3), significant(1e3 * identifying_reach_m(limits_), 3));
    } else if (real_time_) {
      tell_user("tpm: {}\n",
                missing != 0 ? "waiting for the handle to be at rest; let go of it" : "measuring");
    }
  }

 private:
  DeviceLimits limits_;
  bool real_time_;
  std::uint32_t missing_ = 0;
};

/// A session with the delay that was found; none where none was.
std::string next_of_identification(const IdentifyRun& run, const IdentifyChoice& choice) {
  if (!run.counts || !run.found.delay_mean_s || !run.ended_by.empty()) return {};
  DeviceOptions device = choice.device;
  device.file = choice.output;
  return fmt::format("tpm hil run {}{} -o session.tpmrec",
                     shell_word(choice.session.empty() ? "configs/hil_liver.json" : choice.session),
                     device_arguments(device));
}

int identify_hil(const IdentifyChoice& choice, const Session& session) {
  constexpr double kSlowest_Hz = 500.0, kFastest_Hz = 4000.0, kLeast_s = 5.0, kMost_s = 600.0;
  require_new(choice.output, session);
  const DeviceChoice device = chosen_device(choice.device);
  const DeviceLimits limits = limits_of(device);
  HilSession hil;
  if (!choice.session.empty()) hil = read_session(choice.session, {}, limits);
  if (!choice.rate.empty()) {
    hil.servo.period_s =
        1.0 / between(choice.rate, Dimension::frequency, "--loop-rate", kSlowest_Hz, kFastest_Hz);
  }
  const bool hardware = limits.hardware();
  DeviceIdentifyOptions options;
  options.duration_s = between(choice.duration, Dimension::time, "--duration", kLeast_s, kMost_s);
  options.real_time = choice.time.empty() ? hardware : choice.time == "real";
  options.wish = chosen_wish(choice.device);
  const InterruptWatch interrupts(InterruptWatch::Of::motors);
  options.interrupted = InterruptWatch::seen;
  StartWords words(limits, options.real_time);
  options.noticed = warn_of_finding;
  options.watcher = [&words](const ServoRecord& row) { words.see(row); };
  if (hardware) {
    tell_user(
        "tpm: let go of the handle in the middle of its workspace, with 3 cm of free space around "
        "it: it moves by itself for {} with at most 0.3 N\n",
        choice.duration);
  }
  const OutOfMemoryIsThrown while_the_device_is_open;
  std::optional<IdentifyRun> measured;
  try {
    measured = run_identification(device, hil, options);
  } catch (const Error&) {
    if (!InterruptWatch::seen()) throw;
  }
  if (!measured || measured->outcome.cause == StopCause::signal) {
    tell_user("tpm: interrupted; nothing was written\n");
    return InterruptWatch::exit_code();
  }
  const IdentifyRun& run = *measured;
  Json json = device_file_json(run, hardware ? utc_now() : std::string());
  if (run.counts) write_file(choice.output, to_text(json));
  const std::string next = next_of_identification(run, choice);
  std::vector<std::string> files;
  if (run.counts) files = {choice.output};
  if (session.json()) {
    add_end(json, {}, files, next);
    say("{}", answer_text(session, std::move(json),
                          {{"delay_found", run.found.delay_mean_s.has_value()}}));
  } else {
    say("{}{}{}", identified_text(run),
        run.counts ? fmt::format("wrote {}\n", choice.output) : std::string(), next_line(next));
  }
  if (run.ended_by.empty()) return exit_code(run.found.delay_mean_s.has_value());
  tell_user("tpm: identification ended after {} s of {} s: {}{}\n", significant(run.measured_s, 3),
            significant(run.duration_s, 3), run.ended_by,
            run.counts ? "" : "; nothing was written");
  return static_cast<int>(ExitCode::environment);
}

}  // namespace

void add_hil_identify_command(CLI::App& hil, Session& session) {
  CLI::App* command =
      hil.add_subcommand("identify", "Measure delay, friction and mass of a device");
  auto choice = std::make_shared<IdentifyChoice>();
  command->add_option("SESSION", choice->session,
                      "With the rate, the push and the simulated device of this session");
  add_device_options(*command, choice->device);
  command->add_option("--loop-rate", choice->rate,
                      "Rate of the servo loop, 500 Hz to 4 kHz (default: the session's, 1 kHz)");
  command->add_option("--duration", choice->duration, "Duration, 5 s to 10 min")
      ->capture_default_str();
  command
      ->add_option("--clock", choice->time,
                   "Clock of the run: real, or virtual: as fast as it goes (default: real with a "
                   "real device, else virtual)")
      ->check(one_of_words({"real", "virtual"}));
  command
      ->add_option("-o,--output", choice->output,
                   "File to write (schemas/device.schema.json), for --device-file")
      ->capture_default_str();
  command->add_flag("--overwrite", session.force, "Replace files that exist");
  add_format_option(*command, session);
  command->footer(
      "Examples:\n  tpm hil identify --device omega7 -o device.json\n"
      "  tpm hil run configs/hil_omega7.json --device omega7 --device-file device.json");
  set_run(*command, session, [choice, &session] { return identify_hil(*choice, session); });
}

}  // namespace tpm::app
