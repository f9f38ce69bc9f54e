#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace tpm::haptics {

/// When a loop is taken for one whose forces come later than it was told.
struct LateEnergyWatchSettings {
  double period_s = 1e-3;
  double told_s = 0.0;              ///< delay of the device that the loop was told
  double friction_N_s_per_m = 0.0;  ///< of the device, see EnergyWatchSettings
  /// That a longer delay may give to the hand within the window. Below the 2 mJ of EnergyWatch by
  /// what a cycle adds.
  double allowance_J = 1.8e-3;
  double window_s = 2.0;
};

/// Finds a delay that nobody told the loop of, by the energy that it would give away. For each of
/// some delays d that are longer than the one told,
///
///     E_d = sum of f(t - d) . dx + work on the tissue - b |dx|^2 / T
///
/// is what the hand would have received beyond what the tissue had, risen from its lowest value
/// within the window. Positions alone do not tell which d holds: forces that come later move a hand
/// as more damping of the hand would. Therefore the largest E_d counts. A fast motion to and fro
/// has one too, of about K v d times its length, whatever the delay is.
///
/// Neither allocates nor throws but in the constructor.
class LateEnergyWatch {
 public:
  explicit LateEnergyWatch(const LateEnergyWatchSettings& settings);

  /// @param sent_N the command that was given last, on the hand
  /// @param moved_m by the hand since then
  /// @param tissue_work_J on the surface of the tissue meanwhile
  /// @param periods that this took, >= 1
  void observe(const Eigen::Vector3d& sent_N, const Eigen::Vector3d& moved_m, double tissue_work_J,
               int periods) noexcept;
  [[nodiscard]] bool found() const noexcept { return delivered_J_ > settings_.allowance_J; }
  /// Largest E_d, J, >= 0.
  [[nodiscard]] double delivered_J() const noexcept { return delivered_J_; }

  /// Delays that are supposed, s. The longest one is that of hardware that nobody has measured.
  static constexpr std::array<double, 4> kDelays_s{0.005, 0.010, 0.015, 0.020};

 private:
  static constexpr std::size_t kBlocks = 10;  ///< of the window; each keeps its lowest value
  struct Supposed {
    bool counts = false;  ///< it is longer than the delay told
    std::size_t periods = 0;
    double energy_J = 0.0, lowest_J = 0.0;
    std::array<double, kBlocks> lowest_in_J{};
  };

  LateEnergyWatchSettings settings_;
  std::vector<Eigen::Vector3d> sent_N_;  ///< of the last periods, a ring
  std::size_t newest_ = 0;
  std::array<Supposed, kDelays_s.size()> supposed_{};
  std::size_t block_ = 0;
  std::uint64_t block_periods_, in_block_ = 0;
  double friction_N_per_m_;  ///< of a motion within one period
  double delivered_J_ = 0.0;
};

}  // namespace tpm::haptics
