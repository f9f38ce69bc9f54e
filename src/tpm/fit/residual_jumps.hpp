#pragma once
#include <cstddef>
#include <optional>
#include <span>

namespace tpm::fit {

/// One reading or two in a row on one side that leave their neighbours and return.
struct ResidualSpike {
  std::size_t first = 0, length = 0;
  double size = 0.0;  ///< off the line between the readings beside, in units of the residuals
};

/// A spike beyond 8 robust standard deviations that holds most of the squares of the residuals.
/// None below 20 residuals.
[[nodiscard]] std::optional<ResidualSpike> spike_in(std::span<const double> residual);

/// A reading that is far from the one before it, and the next ones stay there, where the drive has
/// come to rest: as when a specimen slips, or a force cell is tared under a load.
struct ResidualJump {
  double at_s = 0.0;
  double by = 0.0;  ///< in units of the residuals
};

/// The largest beyond 20 standard deviations of the noise and 4 of the largest steps around it.
/// @param time_s of the residuals
/// @param ramp_to_s where the drive first reaches its largest value
/// @param noise_sd in units of the residuals
[[nodiscard]] std::optional<ResidualJump> jump_under_load(std::span<const double> time_s,
                                                          std::span<const double> residual,
                                                          double ramp_to_s, double noise_sd);

}  // namespace tpm::fit
