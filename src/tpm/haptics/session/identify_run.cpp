#include "tpm/haptics/session/identify_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <thread>

#include "tpm/base/text.hpp"
#include "tpm/haptics/device/device_keys.hpp"
#include "tpm/haptics/device/forces_off_guard.hpp"
#include "tpm/haptics/loop/empty_space.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::haptics {
namespace {

/// A shorter rest of a measurement is measured for so long.
constexpr double kLeastPart_s = 1.0;
/// Between two parts of a measurement, of which nothing is known.
constexpr double kBetweenParts_s = 0.5;
constexpr std::size_t kPause = 2;  ///< samples that stand for it
/// A call that hung has to come back within so long for another beginning.
constexpr double kComesBack_s = 2.0;
constexpr double kLeastStart_m = 0.005;  ///< radius of the places in which a handle may begin

/// Answers with the forces of the identification, whatever the motion.
class IdentifyingModel final : public EmptySpace {
 public:
  IdentifyingModel(const Eigen::Vector3d& push, double period_s, std::uint64_t seed)
      : EmptySpace(period_s), push_(push), seed_(seed), force_(period_s, seed) {}
  void reset() noexcept override { force_ = IdentifyingForce(period_s(), seed_); }
  ContactAnswer step(const ToolPose& tool) noexcept override {
    const double at_m = push_.dot(tool.displacement_m);
    const double force_N = force_.next_N(at_m);
    ContactAnswer answer;
    answer.force_N = std::abs(at_m) > kLongestStroke_m ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                                       : Eigen::Vector3d(force_N * push_);
    return answer;
  }

 private:
  Eigen::Vector3d push_;
  std::uint64_t seed_;
  IdentifyingForce force_;
};

ServoSettings identifying_settings(const HilSession& like, const DeviceLimits& limits,
                                   double duration_s) {
  ServoSettings servo;
  servo.period_s = like.servo.period_s;
  servo.push = like.servo.push;
  servo.phase_ends = {static_cast<std::uint64_t>(std::llround(duration_s / servo.period_s))};
  // Nor more than the session may send, or the device give.
  servo.force_limit_N =
      std::min({kMostIdentifyingForce_N, like.servo.force_limit_N, limits.force_N});
  servo.slew_limit_N_per_s = limits.slew_N_per_s;
  servo.ramp_in_s = 0.0;
  servo.most_damping_N_s_per_m = 0.0;
  servo.to_model = Eigen::Matrix3d::Identity();
  servo.surface_before_hand_m = 0.0;
  // The forces are small and not a tissue's: there is nothing to watch but the device. Stalls are
  // left out of the measurement.
  servo.most_late = std::numeric_limits<int>::max();
  servo.most_missed = std::numeric_limits<int>::max();
  servo.energy_allowance_J = std::numeric_limits<double>::infinity();
  servo.watch_oscillation = false;
  StartGateSettings gate;
  gate.reach_m = limits.reach_m - kLongestStroke_m;
  servo.gate = gate;
  return servo;
}

std::string in_mm(double length_m) {
  return significant(1e3 * length_m, 3) + " mm";
}

/// Where a number of the device is stated.
std::string place_of(const DeviceChoice& choice, const DeviceLimits& limits, const char* key) {
  return choice.file.empty() ? fmt::format("device '{}': {}", printable(limits.kind), key)
                             : fmt::format("{}: key /limits/{}", choice.file.string(), key);
}

/// A start that no handle can be in is refused before anybody waits for it.
void require_room(const DeviceChoice& choice, const DeviceLimits& limits) {
  const double least_m = kLongestStroke_m + kLeastStart_m;
  if (limits.reach_m >= least_m) return;
  throw Error(
      choice.file.empty() ? ExitCode::environment : ExitCode::bad_input,
      place_of(choice, limits, "reach_m"), shortest(limits.reach_m) + " m",
      fmt::format("at least {} m: the measurement moves the handle by up to {} from a start "
                  "within {} of the middle",
                  shortest(least_m), in_mm(kLongestStroke_m), in_mm(kLeastStart_m)));
}

/// Smaller forces have no edges to measure the delay from.
void require_force(const DeviceChoice& choice, const HilSession& like, const DeviceLimits& limits) {
  const std::string least =
      fmt::format("at least {} N, with which the handle is moved", kLeastIdentifyingForce_N);
  if (limits.force_N < kLeastIdentifyingForce_N) {
    throw Error(choice.file.empty() ? ExitCode::environment : ExitCode::bad_input,
                place_of(choice, limits, "force_N"), shortest(limits.force_N) + " N", least);
  }
  if (like.servo.force_limit_N < kLeastIdentifyingForce_N) {
    throw Error(ExitCode::bad_input, "session: key /limits/force",
                shortest(like.servo.force_limit_N) + " N", least);
  }
}

/// Nobody brings the simulated handle into place.
void require_start(const HilSession& session, const DeviceLimits& limits) {
  OperatorScript script = session.operator_script();
  const double along_m = session.plant.arm_set_point_m.value_or(script.at(0.0).value);
  const double away_m = (session.plant.origin_m + along_m * session.plant.push).norm();
  const double most_m = identifying_reach_m(limits);
  if (away_m <= most_m) return;
  throw Error(ExitCode::bad_input, "start of the simulated handle",
              fmt::format("{} from the middle of the workspace", in_mm(away_m)),
              fmt::format("at most {} (surface and virtual_device/arm_set_point of the session)",
                          in_mm(most_m)));
}

bool is_interrupted(const DeviceIdentifyOptions& options) {
  return ForcesOffGuard::ended_by_signal() || (options.interrupted && options.interrupted());
}

/// Missing condition when a start was given up.
std::string not_in_place(const ServoRecord& row, const DeviceLimits& limits,
                         const StartGateSettings& gate) {
  if ((row.flags & kOutOfReach) != 0) {
    const Eigen::Map<const Eigen::Vector3d> at_m(row.position_m);
    return fmt::format("the handle was {} from the middle of the workspace for {} s; at most {}",
                       in_mm(at_m.norm()), gate.limit_s, in_mm(identifying_reach_m(limits)));
  }
  return fmt::format("the handle was never at rest for {} s within {} s", gate.rest_time_s,
                     gate.limit_s);
}

/// The end of a loop in the words of whoever saw it; what the device says comes first.
std::string end_of(const ServoOutcome& outcome, double cycle_timeout_s) {
  const std::string word(to_string(outcome.cause));
  const std::string said = outcome.device.error_text;
  if (outcome.cause == StopCause::cycle_timeout) {
    return fmt::format("{}: a call of the device, or the machine, took longer than {} ms", word,
                       significant(1e3 * cycle_timeout_s, 3));
  }
  const std::string why = said.empty() || said == outcome.detail ? outcome.detail
                          : outcome.detail.empty()               ? said
                                                                 : outcome.detail + "; " + said;
  return why.empty() ? word : fmt::format("{} ({})", word, why);
}

/// Moves the handle; fills the identity and the outcome of the run, and adds to the samples.
void move_handle(IdentifyRun& run, std::vector<IdentificationSample>& samples,
                 const std::shared_ptr<HapticDevice>& device, const DeviceChoice& choice,
                 const HilSession& like, const DeviceIdentifyOptions& options) {
  run.limits = limits_of(choice);
  require_room(choice, run.limits);
  const ServoSettings servo = identifying_settings(like, run.limits, options.duration_s);
  const auto model = std::make_shared<IdentifyingModel>(servo.push, servo.period_s, options.seed);
  samples.reserve(samples.size() + servo.phase_ends.back() + 1);
  std::string never_begun;
  const RecordSink sink = [&](const ServoRecord& row) {
    if (options.watcher) options.watcher(row);
    if (row.stop == StopCause::not_in_place) {
      never_begun = not_in_place(row, run.limits, *servo.gate);
    }
    if (row.phase < 0 || row.stop != StopCause::none) return;
    // The lateness of a row begins with the first period that it missed.
    const double late_s = static_cast<double>(row.woke_late_s) - row.missed * servo.period_s;
    samples.push_back({servo.push.dot(Eigen::Map<const Eigen::Vector3d>(row.position_m)),
                       servo.push.dot(Eigen::Map<const Eigen::Vector3d>(row.commanded_N)),
                       row.missed, std::max(0.0, late_s), (row.flags & kTimeGuarded) != 0,
                       (row.flags & kSaturated) != 0});
  };
  DevicePreparation preparation =
      preparation_for(like, choice, options.real_time, options.interrupted);
  preparation.max_force_N = servo.force_limit_N;
  const ForcesOffGuard guard(*device);
  FindingNotices notices(*device, options.noticed);
  try {
    run.device = device->open();
    if (choice.kind != "virtual") require_same_device(choice, run.device);
    if (options.opened) options.opened(run.device);
    notices.look();
    if (options.real_time) {
      RealTimeOptions real = real_time_options(like, options.wish, options.interrupted);
      real.idle = [&notices] { notices.look(); };
      real.prepare = [&] { device->prepare(preparation); };
      run.outcome = run_in_real_time(device, model, servo, sink, real);
    } else {
      device->prepare(preparation);
      run.outcome = run_in_virtual_time(*device, *model, servo, sink, options.interrupted);
    }
  } catch (...) {
    device->stop();
    throw;
  }
  // An interruption may end the device first, as where both are of one terminal.
  if (run.outcome.cause != StopCause::finished && is_interrupted(options)) {
    run.outcome.cause = StopCause::signal;
  }
  const StopCause cause = run.outcome.cause;
  run.ended_by = cause == StopCause::finished ? std::string()
                 : never_begun.empty()        ? end_of(run.outcome, like.cycle_timeout_s)
                                              : never_begun;
  if (cause == StopCause::cycle_timeout) return;  // a call may still be under way
  notices.look();
  for (DeviceFinding& finding : device->findings()) {
    if (std::ranges::find(run.findings, finding) == run.findings.end()) {
      run.findings.push_back(std::move(finding));
    }
  }
}

/// True if a machine that stalls may have ended the loop, or a device that was left alone by it.
bool is_stall(StopCause cause) {
  return cause == StopCause::watchdog || cause == StopCause::communication ||
         cause == StopCause::unplugged || cause == StopCause::cycle_timeout;
}

/// Waits for the thread that was left behind in a call: it switches the device off when it ends.
bool came_back(const std::weak_ptr<HapticDevice>& device, const DeviceIdentifyOptions& options) {
  const std::int64_t until_ns = now_ns() + static_cast<std::int64_t>(kComesBack_s * 1e9);
  while (!device.expired() && now_ns() < until_ns && !is_interrupted(options)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return device.expired();
}

/// From what was measured, however it ended.
void identify(IdentifyRun& run, const std::vector<IdentificationSample>& samples) {
  run.found = identify_device(samples, run.period_s);
  DeviceIdentification& found = run.found;
  const std::string lasted =
      fmt::format("{} s of {} s", significant(run.measured_s, 3), significant(run.duration_s, 3));
  run.counts = run.ended_by.empty() || run.measured_s - found.stalled_s >= kLeastMeasured_s;
  if (!run.counts) {
    DeviceIdentification nothing;
    nothing.resolution_s = found.resolution_s;
    nothing.stroke_m = found.stroke_m;
    nothing.stalls = found.stalls;
    nothing.stalled_s = found.stalled_s;
    found = nothing;
    found.not_identified.push_back(
        {"ended_early", fmt::format("everything: ended after {}, and {} s are needed: {}", lasted,
                                    kLeastMeasured_s, run.ended_by)});
    return;
  }
  if (!run.findings.empty() && found.mass_kg) {
    // Friction and mass are in proportion to the forces that the device was sent.
    found.mass_kg = found.mass_low_kg = found.mass_high_kg = std::nullopt;
    found.mass_certain = false;
    found.viscous_N_s_per_m = found.viscous_lower_95_N_s_per_m = std::nullopt;
    found.coulomb_low_N = found.coulomb_high_N = std::nullopt;
    found.not_identified.push_back(
        {"device_finding", "friction, mass: the device noticed: " + run.findings.front().text});
  }
  if (run.ended_by.empty()) return;
  found.not_identified.push_back(
      {"ended", fmt::format("everything after {}: {}", lasted, run.ended_by)});
}

/// Advice against an early end of the check before a session.
const char* help_against(StopCause cause) {
  if (cause == StopCause::not_in_place) return "a handle at rest in the middle of its workspace";
  if (cause == StopCause::unplugged) return "a device that answers (tpm hil devices)";
  if (is_stall(cause)) return "a device and a machine that do not stall (tpm hil check)";
  return "a device whose forces stay on";
}

DeviceLimitKeys limits_that_a_plugin_states(const DeviceLimits& limits) {
  DeviceLimitKeys keys;
  keys.force_N = limits.force_N;
  keys.reach_m = limits.reach_m;
  keys.stiffness_N_per_m = limits.stiffness_N_per_m;
  keys.damping_N_s_per_m = limits.damping_N_s_per_m;
  keys.slew_N_per_s = limits.slew_N_per_s;
  keys.least_ramp_in_s = limits.least_ramp_in_s;
  keys.provenance.emplace();
  for (const char* key : {"force_N", "reach_m", "stiffness_N_per_m", "damping_N_s_per_m",
                          "slew_N_per_s", "least_ramp_in_s"}) {
    keys.provenance->emplace_back(key, "stated by the plugin");
  }
  return keys;
}

}  // namespace

double identifying_reach_m(const DeviceLimits& limits) {
  return limits.reach_m - kLongestStroke_m;
}

DelayCheck check_delay(const std::shared_ptr<HapticDevice>& device, const DeviceChoice& choice,
                       const HilSession& like, const DeviceIdentifyOptions& options) {
  IdentifyRun run;
  DeviceIdentifyOptions second = options;
  second.duration_s = kDelayCheck_s;
  std::vector<IdentificationSample> samples;
  move_handle(run, samples, device, choice, like, second);
  const StopCause cause = run.outcome.cause;
  if (cause == StopCause::signal) {
    throw Error(ExitCode::environment, "delay of the device",
                "the check of a second before the session was interrupted");
  }
  if (cause != StopCause::finished) {
    throw Error(ExitCode::environment, "delay of the device",
                "the check of a second before the session ended early: " + run.ended_by,
                help_against(cause));
  }
  return {checked_delay_s(samples, like.servo.period_s)};
}

IdentifyRun run_identification(const DeviceChoice& choice, const HilSession& like,
                               const DeviceIdentifyOptions& options) {
  if (choice.kind == "replay") {
    throw Error(ExitCode::usage, "--device replay", "does not answer to forces",
                "a device, or virtual");
  }
  HilSession session = like;  // a simulated operator stays where he is
  session.plant.period_s = like.servo.period_s;
  session.plant.push = like.servo.push;
  session.phases = {
      {SessionPhaseKind::rest, "identification", options.duration_s, 0.0, 0.0, 0.0, 0.0}};
  if (choice.kind == "virtual") {
    // Asked to let go, as whoever holds a device is.
    if (session.plant.arm == ArmSettings{}) session.plant.arm = {0.0, 0.0, 0.0, 0.0};
    if (options.real_time) forgive_stalls(session);
    require_start(session, limits_of(choice));
  }
  return run_identification_on([&] { return make_device(choice, session); }, choice, session,
                               options);
}

IdentifyRun run_identification_on(const MakesDevice& make, const DeviceChoice& choice,
                                  const HilSession& like, const DeviceIdentifyOptions& options) {
  require_force(choice, like, limits_of(choice));
  IdentifyRun run;
  run.period_s = like.servo.period_s;
  run.duration_s = options.duration_s;
  run.real_time = options.real_time;
  std::vector<IdentificationSample> samples;
  DeviceIdentifyOptions part = options;
  std::set<std::string> told;  // codes, by any of the parts
  if (options.noticed) {
    part.noticed = [&options, &told](const DeviceFinding& finding) {
      if (told.insert(finding.code).second) options.noticed(finding);
    };
  }
  for (;;) {
    const ServoCounts before = run.outcome.counts;
    const std::uint64_t cycles_before = run.outcome.cycles;
    const std::string ended_before = run.ended_by;
    std::weak_ptr<HapticDevice> left_behind;
    try {
      const std::shared_ptr<HapticDevice> device = make();
      left_behind = device;
      move_handle(run, samples, device, choice, like, part);
    } catch (const Error& error) {
      if (run.measured_s == 0.0 || is_interrupted(options) ||
          error.code() != ExitCode::environment) {
        throw;
      }
      samples.resize(samples.size() - kPause);
      run.ended_by =
          fmt::format("{}, and the device does not open again: {}", ended_before, error.what());
      break;
    }
    const ServoOutcome& ended = run.outcome;
    part.duration_s -= static_cast<double>(ended.cycles) * run.period_s;
    run.outcome.counts.missed += before.missed;
    run.outcome.counts.late += before.late;
    run.outcome.cycles += cycles_before;
    run.measured_s = static_cast<double>(run.outcome.cycles) * run.period_s;
    if (!is_stall(ended.cause) || run.begun_again == kMostBegunAgain) break;
    if (ended.cause == StopCause::cycle_timeout && !came_back(left_behind, options)) {
      run.ended_by += fmt::format(", and did not come back within {} s", kComesBack_s);
      break;
    }
    part.duration_s = std::max(part.duration_s, kLeastPart_s);
    ++run.begun_again;
    // Nobody knows when the force of before ended; it is zero when the next part begins.
    const int between = static_cast<int>(kBetweenParts_s / run.period_s);
    const double last_m = samples.empty() ? 0.0 : samples.back().at_m;
    samples.insert(samples.end(), kPause, {last_m, 0.0, between / 2, 0.0, true});
  }
  identify(run, samples);
  return run;
}

Json device_file_json(const IdentifyRun& run, const std::string& date) {
  constexpr int kDigits = 4;
  const auto digits = [](const std::optional<double>& value) { return rounded(*value, kDigits); };
  const DeviceIdentification& f = run.found;
  DeviceKeys file;
  file.device = run.device.kind;
  file.name = run.device.name;
  if (!run.device.serial.empty()) file.serial = run.device.serial;
  if (run.device.kind == "plugin") file.limits = limits_that_a_plugin_states(run.limits);
  if (f.delay_largest_s) {
    file.delay = {.provenance = KnownBy::measured,
                  .largest_s = digits(f.delay_largest_s),
                  .mean_s = digits(f.delay_mean_s),
                  .jitter_s = digits(f.delay_jitter_s),
                  .resolution_s = rounded(f.resolution_s, kDigits),
                  .hold = "the hold of a command, half a period in the mean, is not included",
                  .tries = f.edges};
  }
  if (f.viscous_lower_95_N_s_per_m) {
    file.viscous_friction = {.provenance = KnownBy::measured,
                             .lower_95_N_s_per_m = digits(f.viscous_lower_95_N_s_per_m),
                             .estimate_N_s_per_m = digits(f.viscous_N_s_per_m)};
  }
  if (f.coulomb_low_N) {
    file.coulomb_friction = {
        .provenance = KnownBy::measured,
        .interval_N = std::vector{digits(f.coulomb_low_N), digits(f.coulomb_high_N)}};
  }
  if (f.encoder_step_m) {
    file.encoder_step = {.provenance = KnownBy::measured,
                         .step_m = digits(f.encoder_step_m),
                         .noise_m = rounded(f.noise_m, kDigits)};
  }
  if (f.mass_kg) {
    file.moving_mass = {.provenance = KnownBy::measured,
                        .mass_kg = std::nullopt,
                        .interval_kg = std::vector{digits(f.mass_low_kg), digits(f.mass_high_kg)}};
    if (f.mass_certain) file.moving_mass->mass_kg = digits(f.mass_kg);
  }
  if (!f.not_identified.empty()) file.not_identified = f.not_identified;
  Json measurement{{"version", version()},
                   {"simulated_device", !run.device.hardware},
                   {"time", run.real_time ? "real" : "virtual"},
                   {"rate_Hz", rounded(1.0 / run.period_s, kDigits)},
                   {"duration_s", rounded(run.duration_s, kDigits)},
                   {"measured_s", rounded(run.measured_s, kDigits)},
                   {"missed_periods", run.outcome.counts.missed},
                   {"stalls", f.stalls},
                   {"stalled_s", rounded(f.stalled_s, kDigits)},
                   {"begun_again", run.begun_again},
                   {"ended", to_string(run.outcome.cause)},
                   {"stroke_m", rounded(f.stroke_m, kDigits)}};
  if (!run.ended_by.empty()) measurement["ended_by"] = run.ended_by;
  if (!run.findings.empty()) measurement["device_findings"] = remarks_json(run.findings);
  if (!date.empty()) measurement["date"] = date;
  if (run.real_time) {
    measurement["host"] = host_line();
    measurement["scheduling"] = run.outcome.scheduling;
  }
  file.measurement = std::move(measurement);
  return device_block().write(file);
}

}  // namespace tpm::haptics
