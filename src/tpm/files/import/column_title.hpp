#pragma once
#include <string>
#include <string_view>

namespace tpm::files {

/// A column title taken apart: "Force [N]", "Force (N)", "Force / N", "Force, N", "Kraft in N",
/// "Force N" and "force_N" all give {"Force", "N"}. The unit is empty if there is none that
/// parse_unit knows, except in square brackets: "Force [foo]" gives "foo", for whoever reads the
/// column to refuse. A number is no unit: "Strain_1" and "Strain (1)" are the first of several, and
/// only "Strain [1]" is a plain number. Capitals of a unit may be others than parse_unit knows if
/// the title tells the dimension: "Time (S)" and "Depth [IN]" keep "S" and "IN" as their units.
struct ColumnTitle {
  std::string name;
  std::string unit;
};

[[nodiscard]] ColumnTitle split_title(std::string_view title);

/// A cell of a unit row without its brackets: "[mm]" -> "mm".
[[nodiscard]] std::string_view without_brackets(std::string_view cell) noexcept;

}  // namespace tpm::files
