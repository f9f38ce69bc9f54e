// Declared in tpm/haptics/loop/servo_step.hpp.
// The force of the tissue in a cycle: how far the tool slips, and what is sent of the model's
// force.
#include <algorithm>
#include <cmath>

#include "tpm/haptics/loop/servo_step.hpp"

namespace tpm::haptics {

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

/// Distance by which the model's tool returns to the hand in a cycle without force: no faster than
/// a force may rise.
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

/// Rendered part of a force that the model computed.
double ServoStep::rendered_N(const ModelForce& model, const Cap& cap, ServoRecord& row) noexcept {
  constexpr double kForgetting = 0.1;
  was_outside_validity_ = !model.valid;
  if (model.valid) {
    outside_validity_steps_ =
        std::max(0.0, outside_validity_steps_ - kForgetting * static_cast<double>(model.steps));
    if (model.force_N > cap.force_N) row.flags |= cap.flag;
    return std::min(model.force_N, cap.force_N);
  }
  outside_validity_steps_ += static_cast<double>(model.steps);
  row.flags |= kBeyondModel;
  if (!model.touching) return 0.0;
  const double before_N = tissue_size_N_;
  const double fallen = before_N - stiffness_N_per_m_ * std::max(0.0, model.withdrawn_m);
  const double faded = before_N * std::exp(-static_cast<double>(model.steps) * settings_.period_s /
                                           settings_.fade_s);
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

}  // namespace tpm::haptics
