#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace tpm::haptics {

/// When a loop is taken for one whose forces come later than it was told.
struct LateEnergyWatchSettings {
  double period_s = 1e-3;
  double lateness_s = 0.020;  ///< of the forces, for the sake of argument
  double window_s = 0.4;      ///< in which the energy is counted and the hand turns
  double allowance_J = 4e-3;
  double growth = 1.2;      ///< of each stroke beyond the one before
  double least_m = 1e-4;    ///< by which a stroke turns
  double slowest_s = 0.25;  ///< of a stroke; slower ones are the operator's
};

/// Finds a delay that nobody told the loop of, by the energy that it would give away:
///
///     E = sum of -f(t - lateness) . dx - work on the tissue, over the window
///
/// is what the hand would have received if forces acted `lateness` after they were sent. An
/// operator who moves on purpose has such an E, too. Therefore the hand must turn back and forth
/// within the window, each stroke longer than the one before by `growth`: a loop that feeds an
/// oscillation does that, an operator rarely: of jerky motions over the surface and into it, one in
/// some thousand. Neither allocates nor throws but in the constructor.
class LateEnergyWatch {
 public:
  explicit LateEnergyWatch(const LateEnergyWatchSettings& settings);

  /// @param sent_N the command that was given last, on the hand
  /// @param along_m where the hand is along the push
  /// @param moved_m by the hand since then
  /// @param tissue_work_J on the surface of the tissue meanwhile
  /// @param periods that this took, >= 1
  void observe(const Eigen::Vector3d& sent_N, double along_m, const Eigen::Vector3d& moved_m,
               double tissue_work_J, int periods) noexcept;
  [[nodiscard]] bool found() const noexcept { return found_; }

 private:
  struct Stroke {
    std::uint64_t end = 0;  ///< period in which the hand turned
    double length_m = 0.0;
  };
  static constexpr std::size_t kStrokes = 3;

  void turn(double along_m) noexcept;
  [[nodiscard]] bool grows(double along_m) const noexcept;
  [[nodiscard]] const Stroke& back(std::size_t i) const noexcept {
    return strokes_[(count_ - 1 - i) % kStrokes];
  }

  LateEnergyWatchSettings settings_;
  std::vector<Eigen::Vector3d> sent_N_;  ///< of the last periods, a ring
  std::vector<double> given_J_;          ///< in each period of the window, a ring
  std::size_t newest_ = 0, oldest_given_ = 0;
  double energy_J_ = 0.0;
  std::array<Stroke, kStrokes> strokes_{};
  std::size_t count_ = 0;
  std::uint64_t now_ = 0, window_periods_, slowest_periods_;
  double extreme_m_ = 0.0, turned_at_m_ = 0.0;
  bool into_ = true, begun_ = false, found_ = false;
};

}  // namespace tpm::haptics
