#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "tpm/device/haptic_device.hpp"
#include "tpm/servo/one_sided_contact.hpp"
#include "tpm/servo/passivity.hpp"
#include "tpm/servo/servo_record.hpp"

namespace tpm {

/// What a servo loop has to do and what it must not exceed.
struct ServoSettings {
  double period_s = 1e-3;
  std::vector<std::uint64_t> phase_ends;  ///< cycles, rising; the last one ends the session
  Eigen::Vector3d push = -Eigen::Vector3d::UnitZ();       ///< device coordinates, unit vector
  Eigen::Vector3d surface_m = Eigen::Vector3d::Zero();    ///< where the tissue begins, device
  Eigen::Vector3d model_push = Eigen::Vector3d::UnitZ();  ///< the same in those of the model
  /// If given, the tool moves in space and the model answers for it as it stands, contact on and
  /// off included: it gets the tool's displacement from `surface_m`, turned by this. Otherwise only
  /// motion along the push reaches the model, one-sided.
  std::optional<Eigen::Matrix3d> to_model = std::nullopt;
  double force_limit_N = 8.0;
  double slew_limit_N_per_s = 400.0;
  double ramp_in_s = 0.5;  ///< forces grow to their size over the first so many seconds
  double most_damping_N_s_per_m = 2.0;  ///< of the passivity controller; 0: it only observes
  /// Stop if so many of the last 1000 cycles were late, or so many periods were missed at once.
  int most_late = 100;
  int most_missed = 50;
  int status_every = 2;  ///< cycles
};

struct ServoCounts {
  std::uint64_t time_guards = 0, saturations = 0, force_limited = 0, slew_limited = 0, damped = 0,
                beyond_model = 0, late = 0, missed = 0;
};

/// One cycle of the loop: read, model, limits, passivity, write. Neither allocates nor locks nor
/// throws.
class ServoStep {
 public:
  /// @param device, model must live as long as this
  ServoStep(HapticDevice& device, ContactModel& model, ServoSettings settings);

  /// @param missed periods that went by without a cycle: the model lives through them too
  /// @return none to go on; the row is filled either way, and the device is stopped if not none
  StopCause cycle(int missed, ServoRecord& row) noexcept;
  /// Zero force, forces off. Bounded. Remembers the first cause.
  void stop(StopCause cause) noexcept;

  [[nodiscard]] const ServoCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const DeviceStatus& device_status() const noexcept { return status_; }
  [[nodiscard]] StopCause cause() const noexcept { return cause_; }
  [[nodiscard]] std::uint64_t cycles() const noexcept { return cycle_; }

 private:
  [[nodiscard]] StopCause read(ServoRecord& row) noexcept;
  void touch(int missed, ServoRecord& row) noexcept;
  void touch_along_push(int steps, ServoRecord& row) noexcept;
  void touch_in_space(int steps, ServoRecord& row) noexcept;
  [[nodiscard]] Eigen::Vector3d limited(const Eigen::Vector3d& wanted_N, ServoRecord& row) noexcept;
  [[nodiscard]] StopCause write(const Eigen::Vector3d& force_N, ServoRecord& row) noexcept;
  [[nodiscard]] StopCause look_at_status() noexcept;
  [[nodiscard]] bool storm(int missed) noexcept;
  [[nodiscard]] StopCause work(int missed, ServoRecord& row) noexcept;

  HapticDevice& device_;
  ContactModel& model_;
  ServoSettings settings_;
  OneSidedContact contact_;
  PassivityControl passivity_;
  ServoCounts counts_;
  DeviceStatus status_;
  Eigen::Vector3d position_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d moved_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d sent_N_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d tissue_N_ = Eigen::Vector3d::Zero();  ///< on the hand, before ramp and limits
  double tool_m_ = 0.0, surface_m_ = 0.0, leak_J_ = 0.0;
  std::uint64_t cycle_ = 0;
  std::size_t phase_ = 0;
  std::vector<char> late_;  ///< of the last cycles served, a ring
  std::size_t served_ = 0;
  int late_now_ = 0;
  bool begun_ = false;
  StopCause cause_ = StopCause::none;
};

}  // namespace tpm
