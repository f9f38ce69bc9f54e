#pragma once
#include <cstddef>
#include <string>

#include "tpmkit/curve.hpp"

namespace tpm::fit {

/// Number of samples before the load, from the first on, in which the drive stands still; all of
/// them if it does so in fewer than 10.
[[nodiscard]] std::size_t still_samples(const Recording& recording, std::size_t at_rest);

/// A load that changes as the probe moves in the air is no drift of the zero: the trend of the
/// samples before the load is not there while the probe stands still.
/// @return what is seen; empty unless it is so
[[nodiscard]] std::string load_in_air(const Recording& recording, std::size_t at_rest);

}  // namespace tpm::fit
