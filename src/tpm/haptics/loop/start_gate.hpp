#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {

/// Watches the tool before a session: forces stay at zero until it is in free air, inside the
/// workspace and at rest. Neither allocates nor throws.
class StartGate {
 public:
  /// @param period_s of the loop, > 0
  StartGate(const StartGateSettings& settings, double period_s) noexcept;

  /// @param periods since the call before, 1 or more; of a longer gap, kMostUnseen_s count as rest,
  ///        for nobody saw what the tool did in it
  /// @param pressed a button of the device; counts from when all else is in place
  /// @param depth_m of the tool, negative in the air; ignored unless `with_surface`
  /// @returns what is missing, ServoFlag bits; 0: the session can begin
  [[nodiscard]] std::uint32_t see(std::uint64_t periods, const Eigen::Vector3d& position_m,
                                  double depth_m, bool with_surface, bool pressed) noexcept;
  static constexpr double kMostUnseen_s = 0.020;
  /// Time goes by, also while the device is not read.
  void count(std::uint64_t periods) noexcept { waited_ += periods; }
  /// The time to get into place is over.
  [[nodiscard]] bool given_up() const noexcept { return waited_ >= limit_; }
  /// The tool was not as free as it seemed: the time at rest starts anew.
  void restart() noexcept { at_rest_ = 0; }

 private:
  StartGateSettings settings_;
  std::uint64_t needed_, limit_, most_unseen_;  ///< periods
  std::uint64_t at_rest_ = 0, waited_ = 0;      ///< periods
  Eigen::Vector3d anchor_m_ = Eigen::Vector3d::Zero();
};

}  // namespace tpm::haptics
