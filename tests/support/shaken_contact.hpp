#pragma once
#include <algorithm>

#include "tpm/contact/element_contact.hpp"
#include "tpmkit/device.hpp"
#include "tpmkit/servo_loop.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::test {
using namespace haptics;

/// A device that is wherever a test puts it.
class Puppet : public HapticDevice {
 public:
  const DeviceIdentity& open() override { return identity_; }
  void prepare(const DevicePreparation&) override {}
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override {
    position_m = at;
    return DeviceAnswer::ok;
  }
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override {
    force = force_N;
    most_N = std::max(most_N, force_N.norm());
    return DeviceAnswer::ok;
  }
  DeviceStatus status() noexcept override { return {}; }
  void begin() noexcept override { ++begun; }
  void stop() noexcept override { ++stops; }
  void cut_forces() noexcept override {}

  Eigen::Vector3d at = Eigen::Vector3d::Zero(), force = Eigen::Vector3d::Zero();
  double most_N = 0.0;
  int begun = 0, stops = 0;

 private:
  DeviceIdentity identity_;
};

/// The star with E1 = E2 = E'.
inline ElementContact element_of(double modulus_Pa, double relaxation_time_s,
                                 double period_s = 1e-3) {
  TpmParameters p;
  p.E1_Pa = p.E2_Pa = p.Eprime_Pa = modulus_Pa;
  return {p.with_relaxation_time(relaxation_time_s), period_s};
}

/// The same without tension that never relaxes: a spring.
inline ElementContact spring_of(double stiffness_N_per_m, double period_s = 1e-3) {
  TpmParameters p;
  p.Eprime_Pa = 0.0;
  p.E1_Pa = p.E2_Pa = stiffness_N_per_m / p.modulus_to_stiffness_m();
  return {p.with_relaxation_time(1e6), period_s};
}

/// Settings of a loop of `cycles` periods that pushes along z and sends its force from the first.
inline ServoSettings guarded(std::uint64_t cycles = 10'000'000) {
  ServoSettings s;
  s.phase_ends = {cycles};
  s.push = Eigen::Vector3d::UnitZ();
  s.ramp_in_s = 0.0;
  return s;
}

}  // namespace tpm::test
