#pragma once
#include <atomic>
#include <chrono>

#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/device/virtual_plant.hpp"
#include "tpmkit/device.hpp"

namespace tpm::haptics {

/// 160 mm diameter and 110 mm length: the maker's data sheet, not looked up; assumed. Wider across
/// and shorter along than the sphere of DeviceLimits::reach_m. Sessions have to fit into both
/// (require_within()).
inline constexpr CylinderWorkspace kOmega7Workspace{0.080, kOmega7StopAlongX_m};

/// A simulated Omega.7 held by a simulated arm, or another device of the list whose row says
/// `plant`. Its time passes in advance() only; in real time its watchdog counts by the clock too,
/// from enable_forces() on, as that of a device does.
class VirtualOmega7 : public HapticDevice {
 public:
  /// @param limits the motors are no stronger, the encoders no finer. The handle stops at the end
  /// of
  ///        kOmega7Workspace, of another device at that of a cylinder around its reach
  VirtualOmega7(const PlantSettings& settings, OperatorScript script,
                const DeviceLimits& limits = limits_of("virtual"));

  const DeviceIdentity& open() override;
  void prepare(const DevicePreparation& preparation) override;
  void enable_forces() override;
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override;
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override;
  DeviceStatus status() noexcept override;
  /// The simulated operator presses a button while the session waits.
  HandState hand() noexcept override;
  void await() noexcept override { plant_.await(); }
  void begin() noexcept override { plant_.begin(); }
  void advance(double seconds) noexcept override;
  void stop() noexcept override;
  void cut_forces() noexcept override;

 private:
  PlantSettings settings_;
  OperatorScript script_;
  VirtualPlant plant_;
  DeviceIdentity identity_;
  double owed_s_ = 0.0;  ///< time that has passed and is no whole period yet
  std::uint64_t saturations_ = 0;
  std::atomic<bool> forces_on_{false};
  using Clock = std::chrono::steady_clock;
  void look_at_clock() noexcept;
  bool on_the_clock_ = false, clock_ran_out_ = false;
  Clock::time_point last_command_;
};

}  // namespace tpm::haptics
