#pragma once
#include "tpmkit/device.hpp"

namespace tpm::haptics {

/// Plays the positions of a recorded session, one a read. Forces go nowhere.
class ReplayDevice final : public HapticDevice {
 public:
  /// @param position_m 3 x samples, as a device read them
  /// @param source for the identity: where they come from
  ReplayDevice(Eigen::Matrix3Xd position_m, const std::string& source);

  const DeviceIdentity& open() override;
  void prepare(const DevicePreparation&) override { next_ = 0; }
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override;
  DeviceAnswer write(const Eigen::Vector3d&) noexcept override { return DeviceAnswer::ok; }
  DeviceStatus status() noexcept override { return {}; }
  void stop() noexcept override {}
  void cut_forces() noexcept override {}

 private:
  Eigen::Matrix3Xd position_m_;
  Eigen::Index next_ = 0;
  DeviceIdentity identity_;
};

}  // namespace tpm::haptics
