#include "tpm/servo/servo_step.hpp"

#include <algorithm>
#include <cmath>

namespace tpm {
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

/// The vendor's numbers for "no device" and "not available".
bool is_gone(int error) {
  return error == 5 || error == 6;
}

}  // namespace

std::string_view word_of(StopCause cause) {
  switch (cause) {
    case StopCause::none:
      return "none";
    case StopCause::finished:
      return "finished";
    case StopCause::signal:
      return "signal";
    case StopCause::exception:
      return "exception";
    case StopCause::communication:
      return "communication error";
    case StopCause::unplugged:
      return "unplugged";
    case StopCause::watchdog:
      return "watchdog of the device";
    case StopCause::velocity:
      return "too fast for the device";
    case StopCause::button:
      return "button of the device";
    case StopCause::software:
      return "forces switched off by software";
    case StopCause::dead_man:
      return "dead man's switch";
    case StopCause::forces_off:
      return "forces cut for an unknown reason";
    case StopCause::position_not_finite:
      return "position not finite";
    case StopCause::force_not_finite:
      return "force not finite";
    case StopCause::overrun_storm:
      return "overrun storm";
    case StopCause::hang:
      return "hang";
  }
  return "unknown";
}

ServoStep::ServoStep(HapticDevice& device, ContactModel& model, ServoSettings settings)
    : device_(device),
      model_(model),
      settings_(std::move(settings)),
      contact_(model, settings_.model_push),
      passivity_(settings_.period_s, settings_.most_damping_N_s_per_m),
      late_(kLateWindow, 0) {
  contact_.reset();
}

StopCause ServoStep::read(ServoRecord& row) noexcept {
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
  return StopCause::none;
}

void ServoStep::touch(int missed, ServoRecord& row) noexcept {
  // The model lives through every period, also those that nobody served.
  const int steps = begun_ ? missed + 1 : 1;
  if (settings_.to_model) {
    touch_in_space(steps, row);
  } else {
    touch_along_push(steps, row);
  }
  row.tool_depth_m = tool_m_;
  row.surface_depth_m = surface_m_;
  row.leak_J = leak_J_;
  if ((row.flags & kBeyondModel) != 0) ++counts_.beyond_model;
}

void ServoStep::touch_along_push(int steps, ServoRecord& row) noexcept {
  const double from = tool_m_;
  tool_m_ = settings_.push.dot(position_m_ - settings_.surface_m);
  OneSidedContact::Answer answer;
  for (int i = 1; i <= steps; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    answer = contact_.step(begun_ ? from + part * (tool_m_ - from) : tool_m_);
  }
  const double moved = answer.touching ? answer.surface_m - surface_m_ : 0.0;
  leak_J_ += 0.5 * contact_.stiffness_N_per_m() * moved * moved;
  surface_m_ = answer.surface_m;
  tissue_N_ = -settings_.push * answer.force_N;
  row.model_force_N = answer.force_N;
  row.model_error_N = answer.error_N;
  if (answer.touching) row.flags |= kTouching;
  if (!answer.trusted) row.flags |= kBeyondModel;
}

void ServoStep::touch_in_space(int steps, ServoRecord& row) noexcept {
  const Eigen::Vector3d to = position_m_ - settings_.surface_m;
  ContactAnswer answer;
  for (int i = 1; i <= steps; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    answer = model_.step(*settings_.to_model * (to - (1.0 - part) * moved_m_));
  }
  const Eigen::Vector3d force_N = settings_.to_model->transpose() * answer.force_N;
  leak_J_ += 0.5 * (tissue_N_ - force_N).dot(moved_m_);
  tissue_N_ = force_N;
  tool_m_ = surface_m_ = settings_.push.dot(to);
  row.model_force_N = -settings_.push.dot(force_N);
  row.model_error_N = answer.error_N;
  if (!force_N.isZero(0.0)) row.flags |= kTouching;
  if (!answer.trusted) row.flags |= kBeyondModel;
}

Eigen::Vector3d ServoStep::limited(const Eigen::Vector3d& wanted_N, ServoRecord& row) noexcept {
  Eigen::Vector3d force = wanted_N;
  const double size = force.norm();
  if (size > settings_.force_limit_N) {
    force *= settings_.force_limit_N / size;
    row.flags |= kForceLimited;
    ++counts_.force_limited;
  }
  const Eigen::Vector3d change = force - sent_N_;
  const double most = settings_.slew_limit_N_per_s * settings_.period_s;
  if (change.norm() > most) {
    force = sent_N_ + change * (most / change.norm());
    row.flags |= kSlewLimited;
    ++counts_.slew_limited;
  }
  return force;
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
  return cause_of(status_.forces_off);
}

bool ServoStep::storm(int missed) noexcept {
  char& slot = late_[served_++ % kLateWindow];
  const char late = missed > 0 ? 1 : 0;
  late_now_ += late - slot;
  slot = late;
  return late_now_ > settings_.most_late || missed > settings_.most_missed;
}

StopCause ServoStep::work(int missed, ServoRecord& row) noexcept {
  if (storm(missed)) return StopCause::overrun_storm;
  StopCause cause = read(row);
  if (cause != StopCause::none) return cause;
  passivity_.observe(sent_N_, moved_m_);
  row.observed_J = passivity_.observed_J();
  touch(missed, row);
  begun_ = true;
  if (!tissue_N_.allFinite()) return StopCause::force_not_finite;
  const double time = static_cast<double>(cycle_) * settings_.period_s;
  const double ramp = settings_.ramp_in_s > 0.0 ? std::min(1.0, time / settings_.ramp_in_s) : 1.0;
  if (ramp < 1.0) row.flags |= kRampingIn;
  const Eigen::Vector3d damping = passivity_.damping_N(moved_m_);
  if (!damping.isZero(0.0)) {
    row.flags |= kDamped;
    ++counts_.damped;
  }
  const Eigen::Vector3d wanted = ramp * tissue_N_ + damping;
  cause = write(limited(wanted, row), row);
  if (cause != StopCause::none) return cause;
  const auto every = static_cast<std::uint64_t>(settings_.status_every);
  return cycle_ % every == 0 ? look_at_status() : StopCause::none;
}

StopCause ServoStep::cycle(int missed, ServoRecord& row) noexcept {
  row = ServoRecord{};
  cycle_ += static_cast<std::uint64_t>(missed);
  while (phase_ < settings_.phase_ends.size() && cycle_ >= settings_.phase_ends[phase_]) ++phase_;
  row.cycle = cycle_;
  row.phase = static_cast<std::int32_t>(phase_);
  row.missed = missed;
  if (missed > 0) {
    row.flags |= kLate;
    ++counts_.late;
    counts_.missed += static_cast<std::uint64_t>(missed);
  }
  const bool over = phase_ >= settings_.phase_ends.size();
  const StopCause cause = over ? StopCause::finished : work(missed, row);
  if (cause == StopCause::none) {
    ++cycle_;
    return cause;
  }
  row.stop = cause;
  stop(cause);
  return cause;
}

void ServoStep::stop(StopCause cause) noexcept {
  if (cause_ == StopCause::none) cause_ = cause;
  device_.stop();
}

}  // namespace tpm
