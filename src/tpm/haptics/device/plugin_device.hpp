#pragma once
#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/device/force_dimension.hpp"
#include "tpmkit/device.hpp"
#include "tpmkit/haptic_device.h"

namespace tpm::haptics {

/// A shared library with haptic devices of its own (tpmkit/haptic_device.h), loaded for as long as
/// this lives.
class DevicePlugin {
 public:
  /// Throws Error(environment) that names what is wrong: the file, the function that it lacks, the
  /// version.
  explicit DevicePlugin(const std::filesystem::path& file);
  ~DevicePlugin();
  DevicePlugin(const DevicePlugin&) = delete;
  DevicePlugin& operator=(const DevicePlugin&) = delete;

  [[nodiscard]] const tpm_device_plugin& calls() const { return *plugin_; }
  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] std::string name() const;
  /// It switches forces on in a call of its own, not in prepare().
  [[nodiscard]] bool enables_forces() const;
  /// It is a stand-in of a test, in which time passes by calls and not by the clock: it has a
  /// function tpm_stand_in_without_clock(), whose answer is not 0.
  [[nodiscard]] bool is_stand_in_without_clock() const;
  /// Throws Error(environment) with the plugin's own words.
  [[nodiscard]] int count() const;
  /// Description that a device gives of itself, its limits checked. Throws Error(environment).
  [[nodiscard]] tpm_device_description describe(int index) const;

 private:
  void load();

  std::string file_;
  void* handle_ = nullptr;
  const tpm_device_plugin* plugin_ = nullptr;
};

/// A device of a plugin.
class PluginDevice final : public HapticDevice {
 public:
  /// Loads the plugin and picks a device without opening it: the one of `which`, or the only one.
  /// Throws Error(environment).
  explicit PluginDevice(const std::filesystem::path& file, const DeviceSelection& which = {});
  ~PluginDevice() override;

  /// As the plugin says; the kind is "plugin".
  [[nodiscard]] DeviceLimits limits() const;
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
  void prepare_plugin();

  std::shared_ptr<const DevicePlugin> plugin_;  ///< shared with a call that is stuck in it
  const tpm_device_plugin& call_;
  int index_ = 0;
  tpm_device_description description_{};
  tpm_device_preparation preparation_{};
  DeviceIdentity identity_;
  DeviceStatus status_;
  void* device_ = nullptr;
  std::atomic<bool> cut_{false};
};

/// The devices of a plugin, none is opened. Throws Error(environment) as DevicePlugin.
[[nodiscard]] std::vector<SeenDevice> seen_devices(const DevicePlugin& plugin);

}  // namespace tpm::haptics
