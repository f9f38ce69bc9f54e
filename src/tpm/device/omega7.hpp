#pragma once
#include <atomic>
#include <filesystem>
#include <memory>

#include "tpm/device/dhd_library.hpp"
#include "tpm/device/haptic_device.hpp"

namespace tpm {

/// An Omega.7 through the vendor's library.
class Omega7 final : public HapticDevice {
 public:
  /// Loads the library. Throws as DhdLibrary does.
  explicit Omega7(const std::filesystem::path& library);
  ~Omega7() override;

  const DeviceIdentity& open() override;
  void prepare(const DevicePreparation& preparation) override;
  DeviceAnswer read(Eigen::Vector3d& position_m) noexcept override;
  DeviceAnswer write(const Eigen::Vector3d& force_N) noexcept override;
  DeviceStatus status() noexcept override;
  void stop() noexcept override;
  void cut_forces() noexcept override;

 private:
  /// Throws Error(environment) with the library's own words if a call failed.
  void require(int answer, const char* call) const;
  [[nodiscard]] std::string last_words() const;
  void require_initialised(const DevicePreparation& preparation);
  void initialise(const std::function<bool()>& interrupted);
  void stop_moving() noexcept;
  void set_watchdog(double seconds);
  DeviceAnswer judged(int answer) noexcept;
  void note_error() noexcept;

  std::shared_ptr<DhdLibrary> library_;  ///< shared with a call that is stuck in it
  const DhdCalls& call_;
  DeviceIdentity identity_;
  DeviceStatus status_;
  char id_ = -1;
  bool open_ = false, prepared_ = false;
  std::atomic<bool> cut_{false};
};

/// How many devices the library sees. Throws Error(environment) as DhdLibrary does.
[[nodiscard]] int count_omega7(const std::filesystem::path& library);

}  // namespace tpm
