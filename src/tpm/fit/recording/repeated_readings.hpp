#pragma once
#include <string>

#include "tpmkit/curve.hpp"

namespace tpm::fit {

/// Words on a channel that a logger holds: it is read more rarely than the rows are written, and
/// each row between repeats its last reading.
///
/// Rounding alone repeats a reading, too. Where a channel moves by m from row to row, with normal
/// noise of any size, its neighbours fall on one step q of rounding with a probability of at most
/// 0.25 q / m. Counted are the rows in which it moves by at least 3 q, over 16 rows on each side:
/// at least 20 of them, of which 40 % repeat the reading before, at 5 different times (the limit of
/// a force cell is one value), while the other channel goes on (along a staircase it does not).
/// Steps q are those of the grid, or where conversion blurred it, the twentieth part of the changes
/// that are smallest.
/// @return "the force repeats its last reading in 180 of 200 rows while the depth moves: ...";
/// empty
///         if no channel is held
[[nodiscard]] std::string repeated_readings(const Recording& recording);

}  // namespace tpm::fit
