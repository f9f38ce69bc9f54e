#pragma once
#include "tpmkit/curve.hpp"

namespace tpm::fit {

/// The share of a recording's readings that are readings of another one: the same times but for one
/// shift, the same drive, and responses that differ by at most 2 % of the scatter; or those of a
/// straight line between two of them. Independent readings are so near in 1 of 90. Finds a copy
/// that was renamed, cut, thinned out, shifted in time, rounded, or sampled again at its own clock,
/// and a part of one whose zeros of drive and response were moved; not one that was filtered or
/// scaled.
/// @param sigma scatter of the recording's responses
[[nodiscard]] double share_of_readings(const Recording& of, const Recording& in, double sigma);

}  // namespace tpm::fit
