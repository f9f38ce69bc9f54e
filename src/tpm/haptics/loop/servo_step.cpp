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

void ServoStep::touch(int missed, ServoRecord& row) noexcept {
  // The model lives through every period, also those that nobody served.
  owed_ += begun_ ? missed : 0;
  const int steps = 1 + std::min(owed_, kMostSteps - 1);
  owed_ -= steps - 1;
  if (settings_.to_model) {
    touch_in_space(steps, row);
  } else {
    touch_along_push(steps, row);
  }
  row.tool_depth_m = tool_m_;
  row.surface_depth_m = surface_m_;
  row.leak_J = leak_J_;
}

/// The largest force that may be sent now, and the flag that says what it is limited by.
ServoStep::Cap ServoStep::cap() const noexcept {
  const double before_N = tissue_size_N_;
  const double time = static_cast<double>(cycle_) * settings_.period_s;
  const double ramp = time < settings_.ramp_in_s ? time / settings_.ramp_in_s : 1.0;
  const double limit = ramp * settings_.force_limit_N;
  // The model comes back to its validity at the force that is being sent.
  const double rising = was_outside_validity_
                            ? before_N
                            : before_N + settings_.slew_limit_N_per_s * settings_.period_s;
  if (rising < limit) return {rising, kSlipping};
  return {limit, ramp < 1.0 ? kRampingIn : kForceLimited};
}

/// How far the model's tool comes back to the hand in a cycle in which nothing is felt: no faster
/// than a force may rise.
double ServoStep::recovery_m() const noexcept {
  return settings_.slew_limit_N_per_s * settings_.period_s / stiffness_N_per_m_;
}

/// The stiffness that the next slip is predicted with, from a motion into the tissue.
void ServoStep::learn_stiffness(double rise_N, double moved_m) noexcept {
  constexpr double kLeastMove_m = 1e-7, kMost = 10.0;
  if (!(moved_m > kLeastMove_m)) return;
  stiffness_N_per_m_ =
      std::clamp(rise_N / moved_m, least_stiffness_N_per_m_, kMost * least_stiffness_N_per_m_);
}

/// What is sent of a force that the model answers.
double ServoStep::rendered_N(const Felt& felt, const Cap& cap, ServoRecord& row) noexcept {
  constexpr double kForgetting = 0.1;
  was_outside_validity_ = !felt.valid;
  if (felt.valid) {
    outside_validity_steps_ =
        std::max(0.0, outside_validity_steps_ - kForgetting * static_cast<double>(felt.steps));
    if (felt.model_N > cap.force_N) row.flags |= cap.flag;
    return std::min(felt.model_N, cap.force_N);
  }
  outside_validity_steps_ += static_cast<double>(felt.steps);
  row.flags |= kBeyondModel;
  if (!felt.touching) return 0.0;
  const double before_N = tissue_size_N_;
  const double fallen = before_N - stiffness_N_per_m_ * std::max(0.0, felt.withdrawn_m);
  const double faded =
      before_N * std::exp(-static_cast<double>(felt.steps) * settings_.period_s / settings_.fade_s);
  return std::max(0.0, std::min(fallen, faded));
}

void ServoStep::touch_along_push(int steps, ServoRecord& row) noexcept {
  const Cap most = cap();
  const double from_m = tool_m_ - slip_m_;
  tool_m_ = settings_.push.dot(position_m_ - settings_.surface_m);
  if (model_N_ == 0.0 && slip_m_ > 0.0) slip_m_ = std::max(0.0, slip_m_ - recovery_m());
  const double predicted_N =
      model_N_ + stiffness_N_per_m_ * (tool_m_ - slip_m_ - contact_.surface_m());
  if (predicted_N > most.force_N && !was_outside_validity_) {
    slip_m_ += (predicted_N - most.force_N) / stiffness_N_per_m_;
    row.flags |= most.flag;
  }
  const double to_m = tool_m_ - slip_m_;
  OneSidedContact::Answer answer;
  const bool touched = model_N_ > 0.0;
  for (int i = 1; i < steps; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    answer = contact_.press(begun_ ? from_m + part * (to_m - from_m) : to_m);
  }
  answer = contact_.press(to_m);
  if (touched && answer.touching && answer.valid && !was_outside_validity_) {
    learn_stiffness(answer.force_N - model_N_, to_m - from_m);
  }
  const double before_N = tissue_size_N_;
  const double moved = answer.surface_m - surface_m_;
  const double now_N =
      rendered_N({answer.force_N, from_m - to_m, steps, answer.touching, answer.valid}, most, row);
  if (answer.touching) leak_J_ += 0.5 * contact_.stiffness_N_per_m() * moved * moved;
  tissue_work_J_ = 0.5 * (before_N + now_N) * moved;
  surface_m_ = answer.surface_m;
  model_N_ = answer.force_N;
  tissue_N_ = -settings_.push * now_N;
  tissue_size_N_ = now_N;
  row.model_force_N = answer.force_N;
  row.model_error_N = answer.error_N;
  if (answer.touching) row.flags |= kTouching;
}

void ServoStep::touch_in_space(int steps, ServoRecord& row) noexcept {
  const Cap most = cap();
  const Eigen::Vector3d hand_m = position_m_ - settings_.surface_m;
  const double slipped_m = slip_in_space_m_.norm();
  if (model_N_ == 0.0 && slipped_m > 0.0) {
    slip_in_space_m_ *= std::max(0.0, 1.0 - recovery_m() / slipped_m);
  }
  Eigen::Vector3d to_m = hand_m - slip_in_space_m_;
  const Eigen::Vector3d from_m = begun_ ? model_tool_m_ : to_m;
  const bool touched = model_N_ > 0.0;
  if (touched && !was_outside_validity_) {
    const Eigen::Vector3d into = -model_force_N_ / model_N_;
    const double predicted_N = model_N_ + stiffness_N_per_m_ * into.dot(to_m - from_m);
    if (predicted_N > most.force_N) {
      const Eigen::Vector3d slip = into * ((predicted_N - most.force_N) / stiffness_N_per_m_);
      slip_in_space_m_ += slip;
      to_m -= slip;
      row.flags |= most.flag;
    }
  }
  ContactAnswer answer;
  for (int i = 1; i <= steps; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(steps);
    answer = model_.step(*settings_.to_model * (from_m + part * (to_m - from_m)));
  }
  const Eigen::Vector3d force_N = settings_.to_model->transpose() * answer.force_N;
  const double size_N = force_N.norm();
  if (touched && size_N > 0.0 && answer.valid && !was_outside_validity_) {
    learn_stiffness(size_N - model_N_, (-model_force_N_ / model_N_).dot(to_m - from_m));
  }
  const Eigen::Vector3d before_N = tissue_N_;
  const Eigen::Vector3d along =
      before_N.isZero(0.0) ? Eigen::Vector3d::Zero() : Eigen::Vector3d(before_N.normalized());
  const double now_N =
      rendered_N({size_N, along.dot(to_m - from_m), steps, size_N > 0.0, answer.valid}, most, row);
  // Only the size is limited; a force outside validity keeps the last valid direction.
  tissue_N_ = !answer.valid  ? Eigen::Vector3d(now_N * along)
              : size_N > 0.0 ? Eigen::Vector3d(force_N * (now_N / size_N))
                             : force_N;
  tissue_size_N_ = tissue_N_.norm();
  tissue_work_J_ = -0.5 * (before_N + tissue_N_).dot(to_m - from_m);
  leak_J_ += 0.5 * (before_N - tissue_N_).dot(moved_m_);
  model_tool_m_ = to_m;
  model_force_N_ = force_N;
  model_N_ = size_N;
  tool_m_ = surface_m_ = settings_.push.dot(hand_m);
  row.model_force_N = -settings_.push.dot(force_N);
  row.model_error_N = answer.error_N;
  if (!force_N.isZero(0.0)) row.flags |= kTouching;
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
