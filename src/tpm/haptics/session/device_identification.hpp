#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tpm/files/json.hpp"

namespace tpm::haptics {

/// Command to a device and its place, in one period.
struct IdentificationSample {
  double at_m = 0.0;       ///< along the direction of the forces, as the device reads it
  double force_N = 0.0;    ///< sent in this period, held until the next one
  int missed = 0;          ///< periods without a cycle before this one
  double late_s = 0.0;     ///< after the beginning of the period in which it was read and sent
  bool stale = false;      ///< the position is that of an earlier call
  bool saturated = false;  ///< the motors gave less than this force
};

/// Identified properties of a device. Values that could not be identified are empty.
struct DeviceIdentification {
  /// From a position to the force that answers it, both paths together: only their sum can be
  /// measured. Without the hold of a command, whose half period comes in addition.
  std::optional<double> delay_mean_s, delay_largest_s, delay_jitter_s;
  double resolution_s = 0.0;  ///< of the delay: half a period
  int edges = 0;              ///< of the force, each a measurement of the delay
  std::optional<double> encoder_step_m;
  double noise_m = 0.0;  ///< of positions, the step's rounding included
  /// Of the device, with whatever holds it. `mass_certain`: to 10 %; else only the interval is
  /// known, which begins at 0 if something holds the handle.
  std::optional<double> mass_kg, mass_low_kg, mass_high_kg;
  bool mass_certain = false;
  std::optional<double> viscous_N_s_per_m, viscous_lower_95_N_s_per_m;
  std::optional<double> coulomb_low_N, coulomb_high_N;
  double held_N_per_m = 0.0;  ///< stiffness of whatever holds the handle
  double stroke_m = 0.0;
  /// Stretches in which nobody read a position for more than kLongestBridge_s, and their length.
  /// They are left out.
  int stalls = 0;
  double stalled_s = 0.0;
  std::vector<Remark> not_identified;  ///< what, and why
};

/// Finds delay, friction and mass from the motion under known forces.
///
/// The motion of a device obeys m x'' + b x' + c sgn x' + k (x - x0) = F(t - d). Multiplied by a
/// smooth function w of time that ends with its derivatives at zero, and integrated by parts, this
/// needs no derivative of the rounded positions:
///
///     int w F(t - d) dt = m int w'' x - b int w' x + c int w sgn x' + k int w x - f int w.
///
/// w is (1 - s^2)^4. Windows of 64 ms give one equation each; for every delay d they are solved by
/// least squares, and the delay with the smallest residual is taken. Each edge of the force is then
/// a measurement of its own delay. Coulomb friction is an unknown of its own and never a part of b.
///
/// Delay and friction are those of a free handle. A hand is no spring: it reacts, and its grip
/// yields, which shifts the delay by milliseconds while the fit still looks good. So k decides:
/// from 3 N/m on something holds the handle, and neither delay nor friction is identified. Nor are
/// they where Coulomb friction is above half the edges of the force, or the motors were saturated.
///
/// Samples need not come on time: a command counts from when it was sent until the next one, and
/// positions are taken linearly between readings that are at most kLongestBridge_s apart, in which
/// forces of the identification bend the motion by 10 um at most. Longer stalls are left out.
/// @param period_s of the samples
[[nodiscard]] DeviceIdentification identify_device(const std::vector<IdentificationSample>& samples,
                                                   double period_s);

/// The delay alone, from a measurement of about a second, s: the largest of all edges if it lies
/// more than the resolution, half a period, above the mean, which is returned otherwise. Empty if
/// the motion does not follow from the forces, as when a hand holds the handle still or moves it.
[[nodiscard]] std::optional<double> checked_delay_s(
    const std::vector<IdentificationSample>& samples, double period_s);

/// Forces for the identification, one a period: edges of +-0.2 N in irregular order, and a weak
/// spring towards the start; never above kMostIdentifyingForce_N.
class IdentifyingForce {
 public:
  IdentifyingForce(double period_s, std::uint64_t seed) noexcept;
  /// @param at_m of the device, from where it began
  [[nodiscard]] double next_N(double at_m) noexcept;

 private:
  double period_s_;
  std::uint64_t state_;
  int left_ = 0;  ///< periods until the next edge
  double sign_ = 1.0;
};
inline constexpr double kMostIdentifyingForce_N = 0.29;
inline constexpr double kLongestBridge_s = 0.008;

}  // namespace tpm::haptics
