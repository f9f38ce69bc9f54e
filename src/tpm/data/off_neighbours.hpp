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

}  // namespace tpm::data
