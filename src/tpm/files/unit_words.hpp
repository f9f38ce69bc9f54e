#pragma once
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/units.hpp"

namespace tpm::files {

/// A unit as parse_unit knows it, for one that a machine writes in another way: "Sec", "sec." and
/// "Sekunden" are "s", "Newton" is "N", "KN" is "kN". Any other text comes back as it is.
[[nodiscard]] std::string written_unit(std::string_view text);

/// The unit of force that a unit of mass stands for in a column of forces: "g" is "gf", "lbs" is
/// "lbf". None for any other text.
[[nodiscard]] std::optional<std::string> force_of_weight(std::string_view text);

/// The units of fitting dimensions that a text is if capitals and small letters are not told apart:
/// "S" of a time is "s" and "IN" of a length is "in", while "MN" of a force may be "mN" or "MN".
/// Only units in which recordings of specimens are written: "Mm" is "mm", not a megametre. Empty if
/// none.
[[nodiscard]] std::vector<std::string> units_in_any_case(
    std::string_view text, const std::function<bool(Dimension)>& is_fitting);

}  // namespace tpm::files
