#include "tpm/haptics/device/replay_device.hpp"

#include "tpmkit/error.hpp"

namespace tpm::haptics {

ReplayDevice::ReplayDevice(Eigen::Matrix3Xd position_m, const std::string& source)
    : position_m_(std::move(position_m)) {
  if (position_m_.cols() == 0) throw bad_input(source, "holds no motion", "a recorded session");
  identity_.kind = "replay";
  identity_.name = "recorded motion of " + source;
  identity_.assumptions = {
      {"recorded_motion", "the motion is a recording: it does not answer to the forces"}};
}

const DeviceIdentity& ReplayDevice::open() {
  return identity_;
}

DeviceAnswer ReplayDevice::read(Eigen::Vector3d& position_m) noexcept {
  if (next_ >= position_m_.cols()) return DeviceAnswer::finished;
  position_m = position_m_.col(next_++);
  return DeviceAnswer::ok;
}

}  // namespace tpm::haptics
