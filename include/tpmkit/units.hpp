#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace tpm {

/// Physical dimensions. All numbers inside the library are SI; other units exist only in files,
/// tables and messages and are converted here only.
enum class Dimension {
  dimensionless,
  time,        // s
  length,      // m
  area,        // m^2
  force,       // N
  stress,      // Pa, also moduli
  viscosity,   // Pa s
  speed,       // m/s
  frequency,   // Hz
  stiffness,   // N/m
  angle,       // rad
  compliance,  // 1/Pa
};

/// A unit of measurement: value_SI = value * to_si.
struct Unit {
  std::string symbol;  ///< as the project writes it, e.g. "kPa", "mm^2", "Pa s"
  Dimension dimension;
  double to_si;
};

/// Reads a unit as people write it: "mm", "Pa.s", "Pa s", "mm/min", "mm^2", "mm2", "N m^-1",
/// "kgf/cm^2", "1/Pa", "rad/s", with the SI prefixes f to G. Case matters where it does in SI (mN
/// is not MN); rad/s is converted to Hz. The symbol is the project's own where it has one. Throws
/// Error(bad_input) naming common units of `expected` if the text is unknown or of another
/// dimension.
/// @param where place for the error message
[[nodiscard]] Unit parse_unit(std::string_view text, Dimension expected, std::string_view where);

/// As above, any dimension.
[[nodiscard]] Unit parse_unit(std::string_view text, std::string_view where);

/// True if `text` is a unit that parse_unit knows.
[[nodiscard]] bool is_unit(std::string_view text);

/// Common units of a dimension, for messages: "N, mN, kN".
[[nodiscard]] std::string units_of(Dimension dimension);

/// The SI unit symbol of a dimension ("" for dimensionless).
[[nodiscard]] std::string_view si_symbol(Dimension dimension) noexcept;

/// The usual unit for soft tissue: mm, N, kPa, s, Hz; otherwise the SI unit.
[[nodiscard]] Unit shown_unit(Dimension dimension);

/// The name in words ("length", "viscosity").
[[nodiscard]] std::string_view dimension_name(Dimension dimension) noexcept;

/// "12 kPa" -> 12000. A quantity is one finite number, white space and one unit (no unit only for
/// a dimensionless quantity). Throws Error(bad_input).
[[nodiscard]] double parse_quantity(std::string_view text, Dimension expected,
                                    std::string_view where);

/// Reads the whole text as one finite decimal number with a decimal point, whatever the locale.
/// Throws Error(bad_input), also for nan, inf and overflow such as 1e400.
[[nodiscard]] double parse_number(std::string_view text, std::string_view where);

/// As parse_number; none if that would throw.
[[nodiscard]] std::optional<double> find_number(std::string_view text) noexcept;

}  // namespace tpm
