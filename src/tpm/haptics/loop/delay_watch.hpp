#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "tpm/haptics/loop/late_energy_watch.hpp"

namespace tpm::haptics {

struct DelayWatchSettings {
  double period_s = 1e-3;
  double told_s = 0.0;  ///< delay of the device that the loop was told
};

/// Finds a delay that has grown, by how the hand moves under the forces sent. For the delay told
/// and each longer one of LateEnergyWatch,
///
///     a(t) = g f(t - d) - c v(t) - k x(t) + f0 + f1 t
///
/// is fitted by least squares to the last motion, three times: with weights that fall with
/// 0.05, 0.12 and 0.35 s. 1/g is the mass of hand and handle, c, k, f0 and f1 are the hand: damper
/// and spring towards a place that moves evenly. g is kept near 2.5/kg (+-1.5/kg), because a
/// contact that is not left makes f proportional to x. Acceleration, speed, place and force are
/// means under (1 - s^2)^4 over 20 ms, so that no difference of positions is taken.
///
/// A rendering that is passive takes energy from every passive hand: c > 0 at the delay told. With
/// a longer one the loop feeds the motion, which shows in two ways: c lies standard errors below 0
/// at the delay told, or a longer delay leaves much less of the acceleration unexplained. Active
/// hands on passive set-ups bring about some of either; found is what is beyond that. A
/// hand that damps more than the loop feeds it shows neither.
///
/// Neither allocates nor throws but in the constructor.
class DelayWatch {
 public:
  explicit DelayWatch(const DelayWatchSettings& settings);

  /// @param at_m place of the hand now, along the push
  /// @param force_N that was sent at the call before, on the hand along the push
  /// @param periods since then, >= 1
  void observe(double at_m, double force_N, int periods) noexcept;
  [[nodiscard]] bool found() const noexcept { return sign_ > 1.0; }
  /// Largest sign now, in parts of what is found.
  [[nodiscard]] double sign() const noexcept { return sign_; }

 private:
  static constexpr std::size_t kWindows = 3, kDelays = 1 + LateEnergyWatch::kDelays_s.size();
  /// v, x, 1, t, then a force for each delay.
  static constexpr Eigen::Index kTerms = 4 + static_cast<Eigen::Index>(kDelays);
  using Terms = Eigen::Matrix<double, kTerms, 1>;

  /// Sums of one fit, with weights that fall.
  struct Sums {
    Eigen::Matrix<double, kTerms, kTerms> terms = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    Terms with_a = Terms::Zero();
    double aa = 0.0, count = 0.0;
  };
  /// Of one delay.
  struct Fit {
    double errors_below_0 = 0.0;  ///< c in standard errors, negative; 0: c is above 0
    double unexplained = 1.0;     ///< part of the acceleration
  };

  void add(double at_m, double force_N) noexcept;
  void look() noexcept;
  [[nodiscard]] Fit fitted(const Sums& sums, std::size_t delay) const noexcept;

  int half_;   ///< periods of half the weight function
  int every_;  ///< periods from one look to the next
  double look_s_;
  std::array<bool, kDelays> supposed_{};
  std::array<Eigen::Index, kDelays> delay_{};  ///< periods
  std::array<double, kWindows> keeps_{};       ///< of the weight, from one look to the next
  Eigen::VectorXd weight_, slope_, bend_;      ///< the weight function and its derivatives
  /// Rings that hold each value twice, so that the newest ones stand in a row.
  Eigen::VectorXd places_m_, forces_N_;
  Eigen::Index place_ = 0, force_ = 0;
  std::uint64_t seen_ = 0;
  int to_look_ = 0;
  bool begun_ = false;
  double before_m_ = 0.0;
  std::array<Sums, kWindows> sums_{};
  double sign_ = 0.0;
};

}  // namespace tpm::haptics
