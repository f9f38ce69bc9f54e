#pragma once
#include <optional>
#include <string_view>

namespace tpm {

/// The parts of "4 mm" or "4mm"; the unit is empty if there is none.
struct QuantityText {
  std::string_view number, unit;
};

/// The unit begins at the first blank, or where there is none behind the number. Nothing is
/// checked.
[[nodiscard]] QuantityText split_quantity(std::string_view text);

/// A share such as "10%" or "0.1"; none if it is no finite number.
[[nodiscard]] std::optional<double> find_share(std::string_view text);

}  // namespace tpm
