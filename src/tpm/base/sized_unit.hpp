#pragma once
#include <string>

#include "tpmkit/units.hpp"

namespace tpm::base {

/// The unit in which a value is read most easily: `usual` where the number then lies from 0.1 to
/// 10,000, else the SI prefix that brings it to 1 or more ("nN", "um", "MPa"). A unit that takes no
/// prefix ("Pa s^alpha", "rad", a number without a unit) stays, and so does it for 0.
/// @param si the value, SI
[[nodiscard]] Unit sized_unit(const Unit& usual, double si);

/// "12.3 nN": a value in its sized_unit().
[[nodiscard]] std::string sized_text(const Unit& usual, double si, int digits);

/// The same in shown_unit() of its dimension.
[[nodiscard]] std::string sized_text(Dimension dimension, double si, int digits);

}  // namespace tpm::base
