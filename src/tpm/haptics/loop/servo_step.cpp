#include "tpm/haptics/loop/servo_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpm/base/namespaces.hpp"

namespace tpm::haptics {
namespace {

constexpr std::size_t kLateWindow = 1000;

StopCause cause_of(ForcesOff off) {
  switch (off) {
    case ForcesOff::none:
      return StopCause::none;
    case ForcesOff::button:
      return StopCause::button;
    case ForcesOff::velocity:
      return StopCause::velocity;
    case ForcesOff::watchdog:
      return StopCause::watchdog;
    case ForcesOff::software:
      return StopCause::software;
    case ForcesOff::unplugged:
      return StopCause::unplugged;
    case ForcesOff::dead_man:
      return StopCause::dead_man;
    case ForcesOff::unknown:
      break;
  }
  return StopCause::forces_off;
}

/// Along the push; in space the largest of any direction.
double stiffness_of(const ContactModel& model, const ServoSettings& settings) {
  constexpr double kLeast_N_per_m = 1.0;
  const Eigen::Matrix3d k = model.instantaneous_stiffness();
  const Eigen::Vector3d push = settings.model_push.normalized();
  return std::max(kLeast_N_per_m, settings.to_model ? k.norm() : push.dot(k * push));
}

/// As announced, else with what is known of the device: K (T/2 + delay) <= b.
bool is_passive(const ContactModel& model, const ServoSettings& settings) {
  if (settings.passive) return *settings.passive;
  const double late_s = (0.5 + settings.delay_periods) * settings.period_s;
  return stiffness_of(model, settings) * late_s <= settings.friction_N_s_per_m;
}

/// The vendor's number for "no device". 6, "not available", is said of calls that a device does not
/// have.
bool is_gone(int error) {
  return error == 5;
}

}  // namespace

std::string_view to_string(StopCause cause) {
  static constexpr auto kNames = std::to_array<Word<StopCause>>({
      {StopCause::none, "none"},
      {StopCause::finished, "finished"},
      {StopCause::signal, "signal"},
      {StopCause::exception, "exception"},
      {StopCause::communication, "communication error"},
      {StopCause::unplugged, "unplugged"},
      {StopCause::watchdog, "watchdog of the device"},
      {StopCause::velocity, "too fast for the device"},
      {StopCause::button, "button of the device"},
      {StopCause::software, "forces switched off by software"},
      {StopCause::dead_man, "dead man's switch"},
      {StopCause::forces_off, "forces cut for an unknown reason"},
      {StopCause::position_not_finite, "position not finite"},
      {StopCause::force_not_finite, "force not finite"},
      {StopCause::overrun_storm, "overrun storm"},
      {StopCause::cycle_timeout, "cycle timeout"},
      {StopCause::not_in_place, "operator not in place"},
      {StopCause::outside_validity, "model outside validity"},
      {StopCause::energy, "energy given to the hand"},
      {StopCause::oscillation, "oscillation"},
      {StopCause::position_jump, "position jumped"},
      {StopCause::damping, "damped for too long"},
  });
  return word_for(kNames, cause, "unknown");
}

ServoStep::ServoStep(HapticDevice& device, ContactModel& model, ServoSettings settings)
    : device_(device),
      model_(model),
      settings_(std::move(settings)),
      contact_(model, settings_.model_push),
      passivity_(settings_.period_s, settings_.most_damping_N_s_per_m),
      energy_({.period_s = settings_.period_s,
               .friction_N_s_per_m = settings_.friction_N_s_per_m,
               .delay_periods = settings_.delay_periods,
               .allowance_J = settings_.energy_allowance_J}),
      oscillation_({.period_s = settings_.period_s}),
      late_({.period_s = settings_.period_s,
             .told_s = settings_.delay_periods * settings_.period_s,
             .friction_N_s_per_m = settings_.friction_N_s_per_m}),
      delay_(
          {.period_s = settings_.period_s, .told_s = settings_.delay_periods * settings_.period_s}),
      passive_(is_passive(model, settings_)),
      outside_validity_periods_(settings_.outside_validity_limit_s / settings_.period_s),
      stiffness_N_per_m_(stiffness_of(model, settings_)),
      least_stiffness_N_per_m_(stiffness_N_per_m_),
      late_cycles_(kLateWindow, 0) {
  contact_.reset();
  if (!settings_.gate) return;
  gate_.emplace(*settings_.gate, settings_.period_s);
}

std::string ServoStep::detail() const {
  if (!too_stale_) return {};
  return fmt::format("positions older than {:g} ms: the answers of the device were late or missing",
                     1e3 * kMostStale_s);
}

StopCause ServoStep::read(int missed, ServoRecord& row) noexcept {
  const Eigen::Vector3d before = position_m_;
  const DeviceAnswer answer = device_.read(position_m_);
  if (answer == DeviceAnswer::finished) return StopCause::finished;
  if (answer == DeviceAnswer::failed) {
    const StopCause cause = look_at_status();
    if (cause != StopCause::none) return cause;
    return is_gone(status_.error) ? StopCause::unplugged : StopCause::communication;
  }
  if (answer == DeviceAnswer::time_guard) {
    ++counts_.time_guards;
    row.flags |= kTimeGuarded;
  }
  std::copy_n(position_m_.data(), 3, row.position_m);
  if (!position_m_.allFinite()) return StopCause::position_not_finite;
  moved_m_ = begun_ ? Eigen::Vector3d(position_m_ - before) : Eigen::Vector3d::Zero();
  stale_ += 1 + missed;
  const double since_s = stale_ * settings_.period_s;
  const double reach_m = settings_.most_speed_m_per_s * std::min(since_s, kMostStale_s);
  if (moved_m_.squaredNorm() > reach_m * reach_m) return StopCause::position_jump;
  if (answer != DeviceAnswer::time_guard) {
    stale_ = 0;
  } else if (since_s > kMostStale_s) {
    too_stale_ = true;
    return StopCause::communication;
  }
  return StopCause::none;
}

/// The tissue's force and, once energy has been given away, damping. It never pulls, and rises no
/// faster than a force may, nor does the tissue's where damping had made it smaller.
Eigen::Vector3d ServoStep::with_damping(ServoRecord& row) noexcept {
  constexpr double kTolerated = 0.1;  // of what ends the session
  const double most_N = std::min(settings_.force_limit_N,
                                 sent_size_N_ + settings_.slew_limit_N_per_s * settings_.period_s);
  Eigen::Vector3d force_N = tissue_N_;
  sent_size_N_ = tissue_size_N_;
  const double delivered_J = energy_.delivered_J() - kTolerated * settings_.energy_allowance_J;
  if (delivered_J > 0.0 && tissue_size_N_ > 0.0) {
    const Eigen::Vector3d damping = passivity_.damping_N(moved_m_, delivered_J);
    if (!damping.isZero(0.0)) {
      row.flags |= kDamped;
      const Eigen::Vector3d out = tissue_N_ / tissue_size_N_;
      force_N += damping;
      const double push_N = force_N.dot(out);
      if (push_N < 0.0) force_N -= push_N * out;
      sent_size_N_ = force_N.norm();
    }
  }
  if (sent_size_N_ <= most_N * (1.0 + 1e-12)) return force_N;
  row.flags |= kForceLimited;
  force_N *= most_N / sent_size_N_;
  sent_size_N_ = most_N;
  return force_N;
}

StopCause ServoStep::check_rendering(int periods) noexcept {
  energy_.observe(sent_N_, moved_m_, tissue_work_J_, periods);
  if (settings_.watch_oscillation) oscillation_.observe(sent_size_N_, periods);
  if (energy_.too_much()) return StopCause::energy;
  if (settings_.watch_oscillation) {
    late_.observe(sent_N_, moved_m_, tissue_work_J_, periods);
    if (passive_) {
      delay_.observe(settings_.push.dot(position_m_), settings_.push.dot(sent_N_), periods);
    }
    const bool late = late_.found() && (!passive_ || delay_.found());
    if (oscillation_.found() || late) return StopCause::oscillation;
    if (damped_share_ > kMostDamped) return StopCause::damping;
  }
  return outside_validity_steps_ > outside_validity_periods_ ? StopCause::outside_validity
                                                             : StopCause::none;
}

StopCause ServoStep::write(const Eigen::Vector3d& force_N, ServoRecord& row) noexcept {
  const DeviceAnswer answer = device_.write(force_N);
  std::copy_n(force_N.data(), 3, row.commanded_N);
  sent_N_ = force_N;
  if (answer == DeviceAnswer::saturated) {
    ++counts_.saturations;
    row.flags |= kSaturated;
  }
  if (answer == DeviceAnswer::time_guard) ++counts_.time_guards;
  if (answer != DeviceAnswer::failed) return StopCause::none;
  const StopCause cause = look_at_status();
  if (cause != StopCause::none) return cause;
  return is_gone(status_.error) ? StopCause::unplugged : StopCause::communication;
}

StopCause ServoStep::look_at_status() noexcept {
  status_ = device_.status();
  hand_ = device_.hand();
  const StopCause cause = cause_of(status_.forces_off);
  if (cause != StopCause::none || !status_.failed) return cause;
  return is_gone(status_.error) ? StopCause::unplugged : StopCause::communication;
}

bool ServoStep::storm(int missed) noexcept {
  char& slot = late_cycles_[served_++ % kLateWindow];
  const char late = missed > 0 ? 1 : 0;
  late_now_ += late - slot;
  slot = late;
  counts_.most_late = std::max(counts_.most_late, late_now_);
  counts_.most_consecutive_missed = std::max(counts_.most_consecutive_missed, missed);
  return late_now_ > settings_.most_late || missed > settings_.most_missed;
}

void ServoStep::count_limits(std::uint32_t flags) noexcept {
  constexpr std::uint32_t kCounted =
      kBeyondModel | kForceLimited | kSlipping | kRampingIn | kDamped;
  if ((flags & kCounted) == 0) return;
  const auto count = [flags](ServoFlag flag) -> std::uint64_t {
    return (flags & flag) != 0 ? 1 : 0;
  };
  counts_.beyond_model += count(kBeyondModel);
  counts_.force_limited += count(kForceLimited);
  counts_.slipped += count(kSlipping);
  counts_.ramping_in += count(kRampingIn);
  counts_.damped += count(kDamped);
}

StopCause ServoStep::work(int missed, ServoRecord& row) noexcept {
  if (storm(missed)) return StopCause::overrun_storm;
  StopCause cause = read(missed, row);
  if (cause != StopCause::none) return cause;
  if (!begun_ && settings_.surface_before_hand_m) {
    settings_.surface_m = position_m_ + *settings_.surface_before_hand_m * settings_.push;
  }
  passivity_.observe(sent_N_, moved_m_);
  row.observed_J = passivity_.observed_J();
  touch(missed, row);
  begun_ = true;
  if (!std::isfinite(model_N_) || !tissue_N_.allFinite()) return StopCause::force_not_finite;
  cause = check_rendering(missed + 1);
  if (cause != StopCause::none) return cause;
  cause = write(with_damping(row), row);
  damped_share_ += (((row.flags & kDamped) != 0 ? 1.0 : 0.0) - damped_share_) * settings_.period_s /
                   kDampedWindow_s;
  count_limits(row.flags);
  if (cause != StopCause::none) return cause;
  if (--to_status_ <= 0) {
    to_status_ = settings_.status_every;
    cause = look_at_status();
  }
  row.gripper_m = hand_.gripper_m;
  row.buttons = hand_.buttons;
  std::copy(std::begin(hand_.grip), std::end(hand_.grip), row.grip);
  return cause;
}

/// A tool that moves in space may touch the tissue above the plane of its surface.
bool ServoStep::free_in_space() noexcept {
  const ContactAnswer answer =
      model_.step(*settings_.to_model * (position_m_ - settings_.surface_m));
  const bool free = answer.force_N.isZero(0.0);
  contact_.reset();
  return free;
}

StopCause ServoStep::wait(int missed, ServoRecord& row) noexcept {
  row.phase = -1;
  row.flags |= kWaiting;
  // Not before: in real time a device is prepared after its loop has been made.
  if (!awaited_) device_.await();
  awaited_ = true;
  const std::uint64_t periods = static_cast<std::uint64_t>(missed) + 1;
  gate_->count(periods);
  StopCause cause = read(missed, row);
  if (cause != StopCause::none) return cause;
  row.tool_depth_m = settings_.push.dot(position_m_ - settings_.surface_m);
  const bool with_surface = !settings_.surface_before_hand_m;
  const std::uint32_t missing =
      gate_->see(periods, position_m_, row.tool_depth_m, with_surface, hand_.buttons != 0);
  row.flags |= missing;
  cause = write(Eigen::Vector3d::Zero(), row);
  if (cause != StopCause::none) return cause;
  cause = look_at_status();
  row.buttons = hand_.buttons;
  if (cause != StopCause::none) return cause;
  if (missing == 0) {
    if (!settings_.to_model || !with_surface || free_in_space()) {
      gate_.reset();
      device_.begin();
      return StopCause::none;
    }
    row.flags |= kInTissue;
    gate_->restart();
  }
  return gate_->given_up() ? StopCause::not_in_place : StopCause::none;
}

/// The row goes on from what was known last, without a command.
void ServoStep::begin_row(int missed) noexcept {
  std::fill_n(row_.commanded_N, 3, 0.0);
  row_.woke_late_s = row_.busy_s = 0.0F;
  row_.flags = 0;
  row_.cycle = cycle_;
  row_.phase = static_cast<std::int32_t>(phase_);
  row_.missed = missed;
}

StopCause ServoStep::cycle(int missed, ServoRecord& row) noexcept {
  const bool waiting = gate_.has_value();
  if (!waiting) {
    cycle_ += static_cast<std::uint64_t>(missed);
    while (phase_ < settings_.phase_ends.size() && cycle_ >= settings_.phase_ends[phase_]) ++phase_;
  }
  begin_row(missed);
  if (missed > 0 && !waiting) {
    row_.flags |= kLate;
    ++counts_.late;
    counts_.missed += static_cast<std::uint64_t>(missed);
  }
  const bool over = phase_ >= settings_.phase_ends.size();
  const StopCause cause = over      ? StopCause::finished
                          : waiting ? wait(missed, row_)
                                    : work(missed, row_);
  if (cause == StopCause::none) {
    if (!waiting) ++cycle_;
  } else {
    row_.stop = cause;
    std::fill_n(row_.commanded_N, 3, 0.0);
    stop(cause);
  }
  row = row_;
  return cause;
}

void ServoStep::stop(StopCause cause) noexcept {
  if (cause_ == StopCause::none) cause_ = cause;
  device_.stop();
}

}  // namespace tpm::haptics
