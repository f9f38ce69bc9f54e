#pragma once
#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/device/dhd_library.hpp"
#include "tpmkit/device.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {

/// Choice among several devices; nothing given: the only one of its kind.
struct DeviceSelection {
  std::optional<int> serial, index;
};

/// A device that the library of Force Dimension sees.
struct SeenDevice {
  int index = 0;
  int type = -1;
  int serial = -1;   ///< -1: not known
  std::string kind;  ///< as limits_of() takes it; empty: of a type that is not known here
  std::string name;  ///< the library's
  DeviceLink link = DeviceLink::unknown;
  bool simulated = false;  ///< a simulator may be behind its link, or its plugin says so
  std::string problem;     ///< why it could not be opened; else empty
};

/// A device with three driven translations through the library of Force Dimension.
class ForceDimension final : public HapticDevice {
 public:
  /// Loads the library. Throws as DhdLibrary does.
  /// @param kind as limits_of() takes it; a device of another type is refused
  explicit ForceDimension(const std::filesystem::path& library, std::string_view kind = "omega7",
                          DeviceSelection which = {});
  ~ForceDimension() override;

  const DeviceIdentity& open() override;
  void prepare(const DevicePreparation& preparation) override;
  void enable_forces() override;
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override;
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override;
  DeviceStatus status() noexcept override;
  HandState hand() noexcept override;
  void stop() noexcept override;
  void cut_forces() noexcept override;

 private:
  [[nodiscard]] Error fault(std::string_view what, std::string_view expected) const;
  /// Throws Error(environment) with the library's own words if a call failed.
  void require(int answer, const char* call) const;
  [[nodiscard]] std::string last_words() const;
  [[nodiscard]] int chosen_index(int count) const;
  void identify();
  void require_initialised(const DevicePreparation& preparation);
  void initialise(const std::function<bool()>& interrupted);
  void stop_moving() noexcept;
  void set_watchdog(double seconds);
  void set_mounting(const DeviceMounting& mounting);
  DeviceAnswer noted(int answer) noexcept;
  void note_error() noexcept;

  std::shared_ptr<DhdLibrary> library_;  ///< shared with a call that is stuck in it
  const DhdCalls& call_;
  DeviceLimits limits_;
  DeviceSelection which_;
  DeviceIdentity identity_;
  DeviceStatus status_;
  char id_ = -1;
  bool prepared_ = false, gripper_ = false;
  std::atomic<bool> open_{false}, moves_itself_{false}, cut_{false};
};

/// Devices that the library sees: each is opened and closed again, none moves.
/// Throws Error(environment) as DhdLibrary does.
[[nodiscard]] std::vector<SeenDevice> seen_devices(const std::filesystem::path& library);

}  // namespace tpm::haptics
