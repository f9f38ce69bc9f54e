#pragma once
#include <Eigen/Core>

namespace tpm::haptics {

/// Counts the work that the hand does on what is rendered, and adds damping while the rendering has
/// given the hand energy that its tissue did not have (EnergyWatch), so that it is taken back
/// (time-domain passivity control after Hannaford and Ryu 2002, whose controller waits until the
/// count itself is negative: energy put in earlier then hides what is given away later).
class PassivityControl {
 public:
  /// @param most_damping_N_s_per_m 0: observe only
  PassivityControl(double period_s, double most_damping_N_s_per_m) noexcept
      : period_s_(period_s), most_damping_(most_damping_N_s_per_m) {}

  /// The hand moved by `moved_m` while `held_N` pushed on it.
  void observe(const Eigen::Vector3d& held_N, const Eigen::Vector3d& moved_m) noexcept;
  /// Addition to the next force on the hand.
  /// @param moved_m in the last period
  /// @param delivered_J to be taken back
  [[nodiscard]] Eigen::Vector3d damping_N(const Eigen::Vector3d& moved_m,
                                          double delivered_J) const noexcept;
  [[nodiscard]] double observed_J() const noexcept { return observed_J_; }

 private:
  double period_s_, most_damping_;
  double observed_J_ = 0.0;
};

}  // namespace tpm::haptics
