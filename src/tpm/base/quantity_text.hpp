#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "tpmkit/units.hpp"

namespace tpm::base {

/// The parts of "4 mm" or "4mm"; the unit is empty if there is none.
struct QuantityText {
  std::string_view number, unit;
};

/// The unit begins at the first blank, or where there is none behind the number. Nothing is
/// checked.
[[nodiscard]] QuantityText split_quantity(std::string_view text);

/// A share such as "10%" or "0.1"; none if it is no finite number.
[[nodiscard]] std::optional<double> find_share(std::string_view text);
/// "0.613 N"; just the number if the unit is 1.
[[nodiscard]] std::string with_unit(std::string_view number, const Unit& unit);

}  // namespace tpm::base
