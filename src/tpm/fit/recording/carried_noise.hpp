#pragma once
#include <cstddef>

#include "tpm/fit/fit.hpp"
#include "tpmkit/curve.hpp"

namespace tpm::fit {

/// Variance that noise of the imposed channel adds to the residual and not to the rest: the law
/// answers the measured channel, noise and all. A change within one sample meets the stiffness (or
/// compliance) of the law there, which is how its answer bends where the channel does.
///
/// The noise is that of the first samples, where the channel stands still: an approach to the
/// tissue that begins among them is a motion, and the corner where it begins no noise. A channel
/// that was rounded to coarse steps q (rounded_levels) shows no noise where it stands still: q^2/12
/// is then the variance of the readings of its motions. 0 for fewer than 10 samples.
/// @param at_rest how many samples there are before the load
[[nodiscard]] double carried_variance(const RecordingFit& fit, const Recording& recording,
                                      std::size_t at_rest);

}  // namespace tpm::fit
