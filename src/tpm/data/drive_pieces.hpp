#pragma once
#include <cstddef>
#include <vector>

namespace tpm::data {

/// Standard deviation of the noise of samples `first` to `last` (inclusive), in the unit of the
/// values: each sample against the straight line through its neighbours, which a smooth signal
/// follows, and the median over all of them, which a few corners do not disturb. The sampling may
/// be uneven. 0 for fewer than 8 samples, which say nothing.
/// @param time  strictly increasing, of the length of `values`
[[nodiscard]] double noise_sd(const std::vector<double>& time, const std::vector<double>& values,
                              std::size_t first, std::size_t last);

/// Motion of the drive.
enum class Motion { still, rising, falling };

/// Samples `first` to `last` (inclusive, first < last) of one motion.
struct DrivePiece {
  Motion motion = Motion::still;
  std::size_t first = 0;
  std::size_t last = 0;
};

/// Cuts a drive where it starts, stops or turns. Neighbouring pieces share the sample between them
/// and have different motions; together they cover everything. A drive that moves no more than its
/// jitter is one still piece, and a fall of less than 5 % of the range inside a rise, or between a
/// rise and a hold, belongs to these.
/// @param time             s, strictly increasing, at least 2
/// @param drive            of the same length
/// @param jitter           standard deviation of the drive's noise, at least 0
/// @param hold_tolerance   part of the drive's range by which a held drive may creep, above 0
[[nodiscard]] std::vector<DrivePiece> drive_pieces(const std::vector<double>& time,
                                                   const std::vector<double>& drive, double jitter,
                                                   double hold_tolerance);

}  // namespace tpm::data
