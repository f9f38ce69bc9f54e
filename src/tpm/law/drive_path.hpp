#pragma once
#include <optional>
#include <span>
#include <vector>

#include "tpmkit/protocol.hpp"

namespace tpm::law {

/// A stretch of an imposed history: the drive moves linearly within h > 0.
struct DriveStep {
  double from, to, h;
};

/// An imposed history without jumps, cut at its knots and at the asked times.
struct DrivePath {
  double start = 0.0;     ///< drive before the first step
  bool relaxed = false;   ///< it was constant for ever, instead of a jump from rest
  double time_scale = 0;  ///< largest time: steps that differ by its rounding are equal
  std::vector<DriveStep> steps;
  std::vector<std::size_t> steps_before;  ///< of each asked time
};

/// Nothing if the history jumps, or if an infinite time is asked for.
[[nodiscard]] std::optional<DrivePath> drive_path(const Protocol& protocol,
                                                  std::span<const double> times_s);

}  // namespace tpm::law
