#pragma once
#include <span>

#include "tpmkit/law_uncertainty.hpp"
#include "tpmkit/protocol.hpp"

namespace tpm::fit {

/// The history with rises that do not follow the straight line between two knots: a rise that is
/// late by `delay_s` stays where it is for 2 delay_s and then goes straight to the second knot; one
/// that is early (below 0) is there 2 |delay_s| before it. Its centre moves by delay_s, and both
/// knots remain, for they are samples. At most half the time between the knots counts; rises whose
/// knots the history does not have are left as they are.
[[nodiscard]] Protocol with_delays(const Protocol& history, std::span<const DelayedRise> rises);

}  // namespace tpm::fit
