#include "tpm/haptics/serve/simulated_hand.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/haptics/loop/real_time.hpp"

namespace tpm::haptics {
namespace {

Eigen::Vector3d no_longer_than(const Eigen::Vector3d& v, double most) {
  const double size = v.norm();
  return size > most ? Eigen::Vector3d(v * (most / size)) : v;
}

}  // namespace

SimulatedHand::SimulatedHand(SimulatedHandSettings settings)
    : settings_(std::move(settings)),
      propagator_(place_propagator(settings_.plant)),
      on_their_way_(static_cast<std::size_t>(settings_.plant.delay_periods) + 1,
                    Eigen::Vector3d::Zero()) {
  force_limit_N_ = settings_.force_limit_N;
  identity_.kind = "virtual";
  identity_.name = "simulated device of tpm hil serve";
  identity_.assumptions = assumptions_of(settings_.plant);
  if (settings_.script.pieces().empty()) {
    settings_.script = OperatorScript({{OperatorPiece::Aim::place, 0.0, 0.0, 0.0}});
  }
  const OperatorAim first = settings_.script.at(0.0);
  const double along_m = first.aim == OperatorPiece::Aim::place ? first.value : 0.0;
  at_m_ = settings_.plant.origin_m + along_m * settings_.plant.push + first.across_m;
  InverseState shown;
  shown.position_m = at_m_;
  shown_.write(shown);
}

const DeviceIdentity& SimulatedHand::open() {
  return identity_;
}

void SimulatedHand::prepare(const DevicePreparation& preparation) {
  force_limit_N_ = std::min(settings_.force_limit_N, preparation.max_force_N);
  owed_s_ = 0.0;
}

DeviceAnswer SimulatedHand::read(Eigen::Vector3d& position_m) noexcept {
  const double step_m = settings_.plant.encoder_step_m;
  position_m = step_m > 0.0 ? Eigen::Vector3d((at_m_ / step_m).array().round() * step_m) : at_m_;
  return DeviceAnswer::ok;
}

DeviceAnswer SimulatedHand::write(const Eigen::Vector3d& force_N) noexcept {
  tissue_N_ = force_N;
  return DeviceAnswer::ok;
}

DeviceStatus SimulatedHand::status() noexcept {
  DeviceStatus status;
  status.saturations = saturations_;
  if (!forces_on_) status.forces_off = ForcesOff::software;
  return status;
}

/// Of a client that has spoken lately.
Eigen::Vector3d SimulatedHand::client_force_N() const noexcept {
  const Wish& wish = asked_.latest();
  const double age_s = static_cast<double>(now_ns() - wish.force_at_ns) * 1e-9;
  return age_s < kDriverSilence_s ? wish.force_N : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

void SimulatedHand::step() noexcept {
  const PlantSettings& plant = settings_.plant;
  (void)asked_.refresh();
  const Wish& wish = asked_.latest();
  const Eigen::Vector3d wanted_N = tissue_N_ + client_force_N();
  const double limit_N = std::min(force_limit_N_.load(), plant.motor_limit_N);
  if (wanted_N.norm() > limit_N) ++saturations_;
  on_their_way_[oldest_] = no_longer_than(wanted_N, limit_N);
  oldest_ = (oldest_ + 1) % on_their_way_.size();
  rendered_N_ = forces_on_ ? on_their_way_[oldest_] : Eigen::Vector3d::Zero();
  largest_N_ = std::max(largest_N_.load(), rendered_N_.norm());
  const OperatorAim aim = settings_.script.at(time_s_);
  Eigen::Vector3d goal_m = wish.goal_m, force_N = rendered_N_;
  if (!wish.guided && plant.arm_set_point_m) {
    goal_m = plant.origin_m + *plant.arm_set_point_m * plant.push;
  } else if (!wish.guided) {
    goal_m = plant.origin_m + aim.value * plant.push + aim.across_m;
    if (aim.aim == OperatorPiece::Aim::force) {
      goal_m += (plant.push.dot(at_m_ - plant.origin_m) - aim.value) * plant.push;
      force_N += aim.value * plant.push;
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d from(at_m_[axis] - goal_m[axis], speed_m_per_s_[axis], force_N[axis]);
    const Eigen::Vector2d next = propagator_ * from;
    at_m_[axis] = goal_m[axis] + next[0];
    speed_m_per_s_[axis] = next[1];
  }
  meet_stop();
  time_s_ += plant.period_s;
}

void SimulatedHand::meet_stop() noexcept {
  const double away_m = at_m_.norm();
  if (away_m <= settings_.reach_m) return;
  const Eigen::Vector3d outwards = at_m_ / away_m;
  at_m_ = settings_.reach_m * outwards;
  speed_m_per_s_ -= std::max(0.0, speed_m_per_s_.dot(outwards)) * outwards;
}

void SimulatedHand::advance(double seconds) noexcept {
  owed_s_ += seconds;
  // Half a period of tolerance: sums of periods are not exact.
  while (owed_s_ > 0.5 * settings_.plant.period_s) {
    step();
    owed_s_ -= settings_.plant.period_s;
  }
  InverseState shown;
  shown.position_m = at_m_;
  shown.velocity_m_per_s = speed_m_per_s_;
  shown.force_N = rendered_N_;
  shown_.write(shown);
}

InverseState SimulatedHand::state() noexcept {
  (void)shown_.refresh();
  InverseState shown = shown_.latest();
  shown.has_grip = true;
  shown.buttons = buttons_;
  const double away_m = std::hypot(shown.position_m.x(), shown.position_m.y());
  if (away_m > 0.0) {
    const Eigen::Vector3d axis(-shown.position_m.y() / away_m, shown.position_m.x() / away_m, 0.0);
    shown.grip = Eigen::AngleAxisd(kLean_rad_per_m * away_m, axis);
  }
  return shown;
}

void SimulatedHand::push(const Eigen::Vector3d& force_N) noexcept {
  // Beyond the limit the size means nothing more.
  wish_.force_N = no_longer_than(force_N, force_limit_N_.load());
  wish_.force_at_ns = now_ns();
  asked_.write(wish_);
}

void SimulatedHand::move_to(const std::optional<Eigen::Vector3d>& position_m) noexcept {
  wish_.guided = position_m.has_value();
  if (position_m) wish_.goal_m = no_longer_than(*position_m, settings_.reach_m);
  asked_.write(wish_);
}

void SimulatedHand::let_go() noexcept {
  wish_.force_N.setZero();
  wish_.force_at_ns = 0;
  asked_.write(wish_);
}

}  // namespace tpm::haptics
