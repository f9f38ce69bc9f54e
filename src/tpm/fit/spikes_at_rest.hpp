#pragma once
#include <span>
#include <vector>

namespace tpm::fit {

/// Marks single readings of a rest that are no noise: further from the median than 8 robust
/// standard deviations, with readings that are nearer on both sides. None if there are more than
/// one in five of them, or fewer than 8 readings.
[[nodiscard]] std::vector<bool> spikes_at_rest(std::span<const double> reading);

/// The readings of a course, single ones far off replaced by the line between their neighbours: a
/// spike is off that line by more than 8 robust standard deviations, and each neighbour off its own
/// by half of that on the other side, which neither a corner nor a step does.
[[nodiscard]] std::vector<double> without_spikes(std::span<const double> time_s,
                                                 std::span<const double> reading);

}  // namespace tpm::fit
