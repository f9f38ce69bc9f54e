#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace tpm::haptics {

/// Settings of the energy watch: what it compares, and when it has seen enough.
struct EnergyWatchSettings {
  double period_s = 1e-3;
  /// Friction that the device is known to have, N s/m: it takes up the energy that a constant force
  /// leaks.
  double friction_N_s_per_m = 0.1;
  int delay_periods = 0;      ///< from a command to its force, as far as it is known
  double allowance_J = 2e-3;  ///< that may be given to the hand within `window_s`
  double window_s = 1.0;
};

/// Finds a rendering that gives energy to the hand. Compared are, period by period, the work of
/// the hand on what is sent to the device and the work on the tissue's surface:
///
///     Q += f_sent . dx_hand - (f_before + f_now)/2 . dx_surface + b |dx_hand|^2 / T
///
/// (forces against the motion). What the tissue stores and gives back is on both sides, so an
/// honest release leaves Q as it is, and energy put in earlier is no credit for later activity.
/// The rest is the leak of the constant force, K dx^2/2 a period, less the friction b of the
/// device. With b > K T/2 (the boundary of passivity) Q never falls; each fall of Q from its
/// largest value of the last second is energy that the hand received from the rendering alone.
///
/// The work on the tissue is counted beside it: a contact that starts at rest can never give back
/// more than it got, so its sum must not fall below zero by more than the allowance either.
///
/// Neither allocates nor throws but in the constructor.
class EnergyWatch {
 public:
  explicit EnergyWatch(const EnergyWatchSettings& settings);

  /// @param sent_N the command that was given last, on the hand
  /// @param moved_m by the hand since then
  /// @param tissue_work_J on the surface of the tissue meanwhile
  /// @param periods that this took, >= 1
  void observe(const Eigen::Vector3d& sent_N, const Eigen::Vector3d& moved_m, double tissue_work_J,
               int periods) noexcept;

  /// Energy given to the hand within the window, J, >= 0.
  [[nodiscard]] double delivered_J() const noexcept { return delivered_J_; }
  /// The largest of delivered_J() so far.
  [[nodiscard]] double most_delivered_J() const noexcept { return most_delivered_J_; }
  [[nodiscard]] double tissue_J() const noexcept { return tissue_J_; }
  [[nodiscard]] bool too_much() const noexcept {
    return delivered_J_ > settings_.allowance_J || tissue_J_ < -settings_.allowance_J;
  }

 private:
  static constexpr std::size_t kBlocks = 10;  ///< of the window; each keeps its largest value

  EnergyWatchSettings settings_;
  std::vector<Eigen::Vector3d> pending_N_;  ///< commands on their way, a ring
  std::size_t oldest_ = 0;
  std::uint64_t block_periods_, in_block_ = 0;
  double friction_N_per_m_;  ///< of a motion within one period
  std::array<double, kBlocks> largest_J_{};
  std::size_t block_ = 0;
  double largest_of_all_J_ = 0.0;
  double q_J_ = 0.0, tissue_J_ = 0.0, delivered_J_ = 0.0, most_delivered_J_ = 0.0;
};

}  // namespace tpm::haptics
