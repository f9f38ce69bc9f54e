#include "tpm/haptics/session/identify_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tpm/base/text.hpp"
#include "tpm/haptics/device/device_keys.hpp"
#include "tpm/haptics/device/forces_off_guard.hpp"
#include "tpm/haptics/loop/real_time.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/version.hpp"

namespace tpm::haptics {
namespace {

constexpr double kLongestStroke_m = 0.020;  ///< from the start, beyond which no force is sent
/// A shorter rest of a measurement is not worth another beginning.
constexpr double kLeastPart_s = 1.0;
/// Between two parts of a measurement, of which nothing is known.
constexpr double kBetweenParts_s = 0.5;
constexpr std::size_t kPause = 2;  ///< samples that stand for it
/// A cycle may take so long: with these forces the watchdog of the device is enough.
constexpr double kCycleTimeout_s = 0.5;

/// Answers with the forces of the identification, whatever the motion.
class IdentifyingModel final : public ContactModel {
 public:
  IdentifyingModel(const Eigen::Vector3d& push, double period_s, std::uint64_t seed)
      : push_(push), period_s_(period_s), seed_(seed), force_(period_s, seed) {}
  void reset() noexcept override { force_ = IdentifyingForce(period_s_, seed_); }
  ContactAnswer step(const ToolPose& tool) noexcept override {
    const double at_m = push_.dot(tool.displacement_m);
    const double force_N = force_.next_N(at_m);
    ContactAnswer answer;
    answer.force_N = std::abs(at_m) > kLongestStroke_m ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                                       : Eigen::Vector3d(force_N * push_);
    return answer;
  }
  [[nodiscard]] double period_s() const noexcept override { return period_s_; }
  [[nodiscard]] Eigen::Matrix3d instantaneous_stiffness() const noexcept override {
    return Eigen::Matrix3d::Identity();
  }
  [[nodiscard]] Eigen::Matrix3d equilibrium_stiffness() const noexcept override {
    return Eigen::Matrix3d::Identity();
  }

 private:
  Eigen::Vector3d push_;
  double period_s_;
  std::uint64_t seed_;
  IdentifyingForce force_;
};

ServoSettings identifying_settings(const HilSession& like, const DeviceLimits& limits,
                                   double duration_s) {
  ServoSettings servo;
  servo.period_s = like.servo.period_s;
  servo.push = like.servo.push;
  servo.phase_ends = {static_cast<std::uint64_t>(std::llround(duration_s / servo.period_s))};
  // Nor more than the session may send.
  servo.force_limit_N = std::min(kMostIdentifyingForce_N, like.servo.force_limit_N);
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

/// Moves the handle; fills the identity and the outcome of the run, and adds to the samples.
void move_handle(IdentifyRun& run, std::vector<IdentificationSample>& samples,
                 const std::shared_ptr<HapticDevice>& device, const DeviceChoice& choice,
                 const HilSession& like, const DeviceIdentifyOptions& options) {
  run.limits = limits_of(choice);
  const ServoSettings servo = identifying_settings(like, run.limits, options.duration_s);
  const auto model = std::make_shared<IdentifyingModel>(servo.push, servo.period_s, options.seed);
  samples.reserve(samples.size() + servo.phase_ends.back() + 1);
  const RecordSink sink = [&](const ServoRecord& row) {
    if (row.phase < 0 || row.stop != StopCause::none) return;
    // The lateness of a row begins with the first period that it missed.
    const double late_s = static_cast<double>(row.woke_late_s) - row.missed * servo.period_s;
    samples.push_back({servo.push.dot(Eigen::Map<const Eigen::Vector3d>(row.position_m)),
                       servo.push.dot(Eigen::Map<const Eigen::Vector3d>(row.commanded_N)),
                       row.missed, std::max(0.0, late_s), (row.flags & kTimeGuarded) != 0});
  };
  DevicePreparation preparation = like.preparation;
  preparation.period_s = servo.period_s;
  preparation.max_force_N = servo.force_limit_N;
  preparation.may_move = choice.may_move;
  preparation.take_as_ready = choice.take_as_ready;
  preparation.real_time = options.real_time;
  preparation.interrupted = options.interrupted;
  const ForcesOffGuard guard(*device);
  try {
    run.device = device->open();
    if (options.opened) options.opened(run.device);
    if (options.real_time) {
      RealTimeOptions real;
      real.wish = options.wish;
      real.cycle_timeout_s = std::max(like.cycle_timeout_s, kCycleTimeout_s);
      real.interrupted = options.interrupted;
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
}

/// Whether a machine that stalls may have ended the loop, or a device that was left alone by it.
bool is_stall(StopCause cause) {
  return cause == StopCause::watchdog || cause == StopCause::communication ||
         cause == StopCause::unplugged;
}

std::string end_of(const ServoOutcome& outcome) {
  const std::string words = outcome.device.error_text;
  return std::string(word_of(outcome.cause)) + (words.empty() ? "" : " (" + words + ")");
}

/// From what was measured, however it ended.
void identify(IdentifyRun& run, const std::vector<IdentificationSample>& samples) {
  run.found = identify_device(samples, run.period_s);
  if (run.ended_by.empty()) return;
  run.found.not_identified.push_back(fmt::format("everything after {} s of {} s: {}",
                                                 significant(run.measured_s, 3),
                                                 significant(run.duration_s, 3), run.ended_by));
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

DelayCheck check_delay(const std::shared_ptr<HapticDevice>& device, const DeviceChoice& choice,
                       const HilSession& like, const DeviceIdentifyOptions& options) {
  IdentifyRun run;
  DeviceIdentifyOptions second = options;
  second.duration_s = kDelayCheck_s;
  std::vector<IdentificationSample> samples;
  move_handle(run, samples, device, choice, like, second);
  DelayCheck check;
  check.cause = run.outcome.cause;
  check.detail = run.outcome.detail;
  const std::string_view said = run.outcome.device.error_text;
  if (!said.empty()) check.detail.append(check.detail.empty() ? "" : "; ").append(said);
  if (check.cause == StopCause::finished) {
    check.delay_s = checked_delay_s(samples, like.servo.period_s);
  }
  return check;
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
  if (choice.kind == "virtual" && options.real_time) forgive_stalls(session);
  session.phases = {
      {SessionPhaseKind::rest, "identification", options.duration_s, 0.0, 0.0, 0.0, 0.0}};
  return run_identification_on([&] { return make_device(choice, session); }, choice, session,
                               options);
}

IdentifyRun run_identification_on(const MakesDevice& make, const DeviceChoice& choice,
                                  const HilSession& like, const DeviceIdentifyOptions& options) {
  IdentifyRun run;
  run.period_s = like.servo.period_s;
  run.duration_s = options.duration_s;
  run.real_time = options.real_time;
  std::vector<IdentificationSample> samples;
  DeviceIdentifyOptions part = options;
  for (;;) {
    const ServoCounts before = run.outcome.counts;
    const std::uint64_t cycles_before = run.outcome.cycles;
    try {
      move_handle(run, samples, make(), choice, like, part);
    } catch (const Error& error) {
      const bool interrupted = options.interrupted && options.interrupted();
      if (run.measured_s == 0.0 || interrupted || error.code() != ExitCode::environment) throw;
      samples.resize(samples.size() - kPause);
      run.ended_by += fmt::format(", and the device does not open again: {}", error.what());
      break;
    }
    const ServoOutcome& ended = run.outcome;
    part.duration_s -= static_cast<double>(ended.cycles) * run.period_s;
    run.outcome.counts.missed += before.missed;
    run.outcome.counts.late += before.late;
    run.outcome.cycles += cycles_before;
    run.measured_s = static_cast<double>(run.outcome.cycles) * run.period_s;
    run.ended_by = ended.cause == StopCause::finished ? std::string() : end_of(ended);
    if (!is_stall(ended.cause) || part.duration_s < kLeastPart_s ||
        run.begun_again == kMostBegunAgain) {
      break;
    }
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
                   {"ended", word_of(run.outcome.cause)},
                   {"stroke_m", rounded(f.stroke_m, kDigits)}};
  if (!run.ended_by.empty()) measurement["ended_by"] = run.ended_by;
  if (!date.empty()) measurement["date"] = date;
  if (run.real_time) {
    measurement["host"] = host_line();
    measurement["scheduling"] = run.outcome.scheduling;
  }
  file.measurement = std::move(measurement);
  return device_block().write(file);
}

}  // namespace tpm::haptics
