#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace tpm::files {

/// A unit as parse_unit knows it, for one that a machine writes in another way: "Sec", "sec." and
/// "Sekunden" are "s", "Newton" is "N", "KN" is "kN". Any other text comes back as it is.
[[nodiscard]] std::string written_unit(std::string_view text);

/// The unit of force that a unit of mass stands for in a column of forces: "g" is "gf", "lbs" is
/// "lbf". None for any other text.
[[nodiscard]] std::optional<std::string> force_of_weight(std::string_view text);

}  // namespace tpm::files
