#pragma once
#include <string>

#include "tpmkit/units.hpp"

namespace tpm::base {

/// A regular expression (ECMA 262) of the texts that parse_quantity() reads: a number, and a unit
/// of the dimension by one name or as a quotient of two. What is written with powers, points or
/// spaces within the unit passes, too, whatever its dimension. Overflow is not seen.
/// @param sign +1: texts of numbers above 0 alone; 0: of 0, too; -1: of all
[[nodiscard]] std::string quantity_pattern(Dimension dimension, int sign);

}  // namespace tpm::base
