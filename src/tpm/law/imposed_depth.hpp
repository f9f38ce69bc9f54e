#pragma once
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "tpm/law/contact_history.hpp"
#include "tpm/protocol/protocol.hpp"

namespace tpm {

/// A stretch of an imposed history: the drive moves linearly within h > 0.
struct DriveStep {
  double from, to, h;
};

/// An imposed history without jumps, cut at its knots and at the asked times.
struct DrivePath {
  double start = 0.0;     ///< drive before the first step
  bool relaxed = false;   ///< it was held for ever, instead of a jump from rest
  double time_scale = 0;  ///< largest time: steps that differ by its rounding are equal
  std::vector<DriveStep> steps;
  std::vector<std::size_t> steps_before;  ///< of each asked time
};

/// Nothing if the history jumps, or if an infinite time is asked for.
[[nodiscard]] std::optional<DrivePath> drive_path(const Protocol& protocol,
                                                  std::span<const double> times_s);

/// What ContactHistory answers to an imposed drive, for laws whose branches have times among the
/// parameters: all steps of one branch after those of another, in plain arrays, several times as
/// fast. Agrees with it to the tolerance of both, 1e-10 of the peak; derivatives to 1e-5 where the
/// sampling is uneven by a few millionths.
/// @return nothing if the surface leaves the probe: then only ContactHistory has the answer
[[nodiscard]] std::optional<Response> respond_in_contact(const LawAtParameters& law,
                                                         const DrivePath& path, Want want);

/// The kernel at 1/4, 1/2 and 3/4 between two depths from its values and slopes at both: cubic
/// interpolation, for depths that differ by so little (kCubicPart) that it holds to 1e-10.
struct KernelBetween {
  std::array<double, 3> value;
  std::array<double, 3> slope;  ///< dV/du
};
inline constexpr double kCubicPart = 3e-3;  ///< of the smaller depth
[[nodiscard]] KernelBetween kernel_between(double depth_change, double v0, double slope0, double v1,
                                           double slope1);

}  // namespace tpm
