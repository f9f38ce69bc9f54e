#include "tpm/haptics/device/virtual_plant.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unsupported/Eigen/MatrixFunctions>

namespace tpm::haptics {
namespace {

std::string line_of(const char* format, double value) {
  char line[160];
  (void)std::snprintf(line, sizeof line, format, value);
  return line;
}

Eigen::Matrix<double, 2, 3> propagator(const PlantSettings& settings, double stiffness_N_per_m) {
  const double mass = settings.mass_kg + settings.arm.mass_kg;
  const double damping = settings.damping_N_s_per_m + settings.arm.damping_N_s_per_m;
  Eigen::Matrix3d rate = Eigen::Matrix3d::Zero();
  rate(0, 1) = 1.0;
  rate.row(1) << -stiffness_N_per_m / mass, -damping / mass, 1.0 / mass;
  const Eigen::Matrix3d scaled = rate * settings.period_s;
  const Eigen::Matrix3d grown = scaled.exp();
  return grown.topRows<2>();
}

}  // namespace

Eigen::Matrix<double, 2, 3> place_propagator(const PlantSettings& settings) {
  return propagator(settings, settings.arm.stiffness_N_per_m);
}

std::vector<Remark> assumptions_of(const PlantSettings& s) {
  std::vector<Remark> assumptions{
      {"moving_mass", line_of("moving mass %g kg (assumed; 0.2 to 0.4 is usual)", s.mass_kg)},
      {"viscous_friction",
       line_of("viscous friction %g N s/m (assumed; 0.1 to 1 is usual)", s.damping_N_s_per_m)},
      {"encoder_step",
       line_of("encoder step %g m (assumed; the Omega.7's data sheet says below 1e-5)",
               s.encoder_step_m)},
      {"force_delay",
       line_of("delay from command to force %g s (assumed)", s.delay_periods * s.period_s)},
      {"speed_limit", line_of("forces cut above %g m/s (assumed)", s.velocity_limit_m_per_s)},
      {"operator_arm", "arm of the operator: " + line_of("%g kg, ", s.arm.mass_kg) +
                           line_of("%g N s/m, ", s.arm.damping_N_s_per_m) +
                           line_of("%g N/m (one published fit)", s.arm.stiffness_N_per_m)},
      {"operator_eye",
       line_of("eye of the operator: a wrong depth is corrected at %g a second (assumed)",
               s.arm.correction_per_s)},
  };
  if (s.workspace) {
    assumptions.push_back(
        {"workspace_stop",
         line_of("stop at the end of the workspace, a cylinder about x of %g m ",
                 2.0 * s.workspace->radius_m) +
             line_of("diameter and %g m length (assumed)", 2.0 * s.workspace->half_length_m)});
  }
  if (s.least_watchdog_s > 0.0)
    assumptions.push_back(
        {"least_watchdog", line_of("a watchdog that waits %g s at least, which no Omega.7 does",
                                   s.least_watchdog_s)});
  return assumptions;
}

VirtualPlant::VirtualPlant(const PlantSettings& settings, OperatorScript script)
    : settings_(settings),
      script_(std::move(script)),
      push_(settings.push.normalized()),
      to_place_(propagator(settings, settings.arm.stiffness_N_per_m)),
      free_(propagator(settings, 0.0)),
      pending_(static_cast<std::size_t>(settings.delay_periods) + 1, Eigen::Vector3d::Zero()) {
  if (script_.pieces().empty())
    script_ = OperatorScript({{OperatorPiece::Aim::place, 0.0, 0.0, 0.0}});
  const OperatorAim first = script_.at(0.0);
  along_ = meant_ = settings_.arm_set_point_m.value_or(first.value);
  across_ = first.across_m;
  meet_stop();
}

void VirtualPlant::meet_stop() noexcept {
  stop_.setZero();
  if (!settings_.workspace) return;
  const CylinderWorkspace& workspace = *settings_.workspace;
  const Eigen::Vector3d at_m = position_m();
  const double around_m = std::hypot(at_m.y(), at_m.z());
  const double beyond_end_m = std::abs(at_m.x()) - workspace.half_length_m;
  const double beyond_side_m = around_m - workspace.radius_m;
  if (!(beyond_end_m > 0.0 || beyond_side_m > 0.0)) return;
  Eigen::Vector3d moved_m = Eigen::Vector3d::Zero(), speed = velocity_m_per_s();
  const auto meet = [&](const Eigen::Vector3d& outwards, double beyond_m) {
    if (!(beyond_m > 0.0)) return;
    moved_m -= beyond_m * outwards;
    speed -= std::max(0.0, speed.dot(outwards)) * outwards;
    stop_ += outwards;
  };
  meet(Eigen::Vector3d::UnitX() * std::copysign(1.0, at_m.x()), beyond_end_m);
  meet(Eigen::Vector3d(0.0, at_m.y(), at_m.z()) / std::max(around_m, workspace.radius_m),
       beyond_side_m);
  along_ += moved_m.dot(push_);
  across_ += moved_m - moved_m.dot(push_) * push_;
  along_speed_ = speed.dot(push_);
  across_speed_ = speed - along_speed_ * push_;
}

void VirtualPlant::begin() noexcept {
  waiting_ = false;
  began_ = periods_;
}

OperatorAim VirtualPlant::aim() noexcept {
  if (settings_.arm_set_point_m) return {OperatorPiece::Aim::place, *settings_.arm_set_point_m};
  if (!waiting_) return script_.at(static_cast<double>(periods_ - began_) * settings_.period_s);
  const OperatorPiece& first = script_.pieces().front();
  return {OperatorPiece::Aim::place, first.aim == OperatorPiece::Aim::place ? first.from : along_,
          0.0, first.across_from_m};
}

double VirtualPlant::time_s() const noexcept {
  return static_cast<double>(periods_) * settings_.period_s;
}

Eigen::Vector3d VirtualPlant::measured_m() const noexcept {
  Eigen::Vector3d at = position_m();
  if (!(settings_.encoder_step_m > 0.0)) return at;
  const double step = settings_.encoder_step_m;
  return {std::round(at.x() / step) * step, std::round(at.y() / step) * step,
          std::round(at.z() / step) * step};
}

bool VirtualPlant::command(const Eigen::Vector3d& force_N) noexcept {
  const double size = force_N.norm();
  const bool clipped = size > settings_.motor_limit_N;
  command_ = clipped ? Eigen::Vector3d(force_N * (settings_.motor_limit_N / size)) : force_N;
  since_command_ = 0;
  return clipped;
}

void VirtualPlant::advance() noexcept {
  const double period = settings_.period_s;
  if (static_cast<double>(since_command_++) * period >= settings_.watchdog_s) {
    watchdog_tripped_ = true;
  }
  pending_[oldest_] = command_;
  oldest_ = (oldest_ + 1) % pending_.size();
  const bool on = forces_on_ && !watchdog_tripped_ && !too_fast_;
  const Eigen::Vector3d force = on ? pending_[oldest_] : Eigen::Vector3d::Zero();

  const OperatorAim aim = this->aim();
  const bool place = aim.aim == OperatorPiece::Aim::place;
  const double drag = settings_.damping_N_s_per_m;
  double push = force.dot(push_);
  const Eigen::Vector3d across_force = force - push * push_;
  if (place) {
    // Coming from a push, the hand means to be where it is.
    if (!aimed_at_place_) meant_ = along_;
    const double off_m = aim.value - along_;
    const bool beyond_stop = stop_.dot(push_) * off_m > 0.0;
    const double correction_per_s = beyond_stop ? 0.0 : settings_.arm.correction_per_s;
    const double meant_rate = aim.rate + correction_per_s * off_m;
    const Eigen::Vector3d state(along_ - meant_, along_speed_ - meant_rate,
                                push - drag * meant_rate);
    const Eigen::Vector2d next = to_place_ * state;
    meant_ += meant_rate * period;
    along_ = next[0] + meant_;
    along_speed_ = next[1] + meant_rate;
  } else {
    const Eigen::Vector2d next = free_ * Eigen::Vector3d(along_, along_speed_, push + aim.value);
    along_ = next[0];
    along_speed_ = next[1];
  }
  aimed_at_place_ = place;
  // Across, the hand goes where it means to; no eye corrects it.
  for (int axis = 0; axis < 3; ++axis) {
    const double meant = aim.across_m[axis];
    const double meant_rate = aim.across_m_per_s[axis];
    const Eigen::Vector3d state(across_[axis] - meant, across_speed_[axis] - meant_rate,
                                across_force[axis] - drag * meant_rate);
    const Eigen::Vector2d next = to_place_ * state;
    across_[axis] = next[0] + (meant + meant_rate * period);
    across_speed_[axis] = next[1] + meant_rate;
  }
  ++periods_;
  if (velocity_m_per_s().norm() > settings_.velocity_limit_m_per_s) too_fast_ = true;
  meet_stop();
}

}  // namespace tpm::haptics
