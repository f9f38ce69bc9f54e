#include "tpm/haptics/device/virtual_omega7.hpp"

#include <algorithm>

namespace tpm::haptics {
namespace {

PlantSettings limited(PlantSettings settings, const DeviceLimits& limits) {
  settings.motor_limit_N = std::min(settings.motor_limit_N, limits.force_N);
  settings.encoder_step_m = std::max(settings.encoder_step_m, limits.encoder_step_m);
  settings.workspace = limits.kind == "virtual" ? kOmega7Workspace
                                                : CylinderWorkspace{limits.reach_m, limits.reach_m};
  return settings;
}

}  // namespace

VirtualOmega7::VirtualOmega7(const PlantSettings& settings, OperatorScript script,
                             const DeviceLimits& limits)
    : settings_(limited(settings, limits)), script_(std::move(script)), plant_(settings_, script_) {
  identity_.kind = limits.kind;
  identity_.name = limits.name;
}

const DeviceIdentity& VirtualOmega7::open() {
  identity_.link = DeviceLink::none;
  identity_.assumptions = assumptions_of(settings_);
  return identity_;
}

void VirtualOmega7::prepare(const DevicePreparation& preparation) {
  settings_.watchdog_s = std::max(preparation.watchdog_s, settings_.least_watchdog_s);
  plant_ = VirtualPlant(settings_, script_);
  saturations_ = 0;
  owed_s_ = 0.0;
  forces_on_ = false;
  on_the_clock_ = preparation.real_time;
  clock_ran_out_ = false;
}

void VirtualOmega7::enable_forces() {
  last_command_ = Clock::now();
  forces_on_ = true;
  (void)plant_.command(Eigen::Vector3d::Zero());
}

/// Turns forces off for good when a command comes too late by the clock.
void VirtualOmega7::look_at_clock() noexcept {
  if (!on_the_clock_ || !forces_on_) return;
  const std::chrono::duration<double> without_command = Clock::now() - last_command_;
  if (without_command.count() >= settings_.watchdog_s) clock_ran_out_ = true;
}

DeviceAnswer VirtualOmega7::read(Eigen::Vector3d& position_m) noexcept {
  position_m = plant_.measured_m();
  return DeviceAnswer::ok;
}

DeviceAnswer VirtualOmega7::write(const Eigen::Vector3d& force_N) noexcept {
  look_at_clock();
  if (on_the_clock_) last_command_ = Clock::now();
  if (!plant_.command(force_N)) return DeviceAnswer::ok;
  ++saturations_;
  return DeviceAnswer::saturated;
}

DeviceStatus VirtualOmega7::status() noexcept {
  look_at_clock();
  DeviceStatus status;
  status.saturations = saturations_;
  if (plant_.too_fast()) {
    status.forces_off = ForcesOff::velocity;
  } else if (plant_.watchdog_tripped() || clock_ran_out_) {
    status.forces_off = ForcesOff::watchdog;
  } else if (!forces_on_) {
    status.forces_off = ForcesOff::software;
  }
  return status;
}

HandState VirtualOmega7::hand() noexcept {
  HandState hand;
  hand.buttons = plant_.waiting() ? 1U : 0U;
  return hand;
}

void VirtualOmega7::advance(double seconds) noexcept {
  owed_s_ += seconds;
  plant_.forces(forces_on_ && !clock_ran_out_);
  // Half a period of tolerance: sums of periods are not exact.
  while (owed_s_ > 0.5 * settings_.period_s) {
    plant_.advance();
    owed_s_ -= settings_.period_s;
  }
}

void VirtualOmega7::stop() noexcept {
  (void)plant_.command(Eigen::Vector3d::Zero());
  forces_on_ = false;
}

void VirtualOmega7::cut_forces() noexcept {
  forces_on_ = false;
}

}  // namespace tpm::haptics
