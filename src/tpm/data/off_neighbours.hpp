#pragma once
#include <span>
#include <vector>

namespace tpm::data {

/// What noise and corners leave of a course: of every sample but the first and the last, its value
/// less the straight line between its neighbours, divided by what makes the standard deviation of
/// independent noise of this difference that of a sample. The sampling may be uneven. Empty for
/// fewer than 3 samples.
/// @param time  strictly increasing, of the length of `values`
[[nodiscard]] std::vector<double> off_neighbours(std::span<const double> time,
                                                 std::span<const double> values);

/// Standard deviation of normal noise from what off_neighbours() leaves: 1.4826 times the median of
/// the distances, which a few corners do not disturb. 0 if there are none, or if more than half of
/// the samples lie on the line, as coarsely rounded ones at rest do.
[[nodiscard]] double noise_of(std::vector<double> off);

/// The same of a course, and 0 if it is what computing leaves of a straight line.
/// @param time  strictly increasing, of the length of `values`
[[nodiscard]] double noise_about_neighbours(std::span<const double> time,
                                            std::span<const double> values);

}  // namespace tpm::data
