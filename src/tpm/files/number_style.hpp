#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace tpm::files {

struct DelimitedRow;

/// The mark between groups of three digits.
enum class ThousandsMark {
  none,
  comma,
  point,
  apostrophe,  ///< straight or typographic, as in Switzerland
  space,       ///< also the no-break spaces
};

/// "none", "comma", ... as --thousands takes them.
[[nodiscard]] std::string_view thousands_name(ThousandsMark mark) noexcept;
/// Throws Error(bad_input).
[[nodiscard]] ThousandsMark parse_thousands_name(std::string_view text, std::string_view where);

/// Notation of a file's numbers.
struct NumberStyle {
  bool decimal_comma = false;                     ///< "3,5" is three and a half
  ThousandsMark thousands = ThousandsMark::none;  ///< never the decimal sign

  [[nodiscard]] bool operator==(const NumberStyle&) const = default;
};

/// The finite number that a field holds in this style; none if it holds another text. Marks of
/// thousands must stand before groups of exactly three digits. A typographic minus is a minus.
[[nodiscard]] std::optional<double> find_styled_number(std::string_view field, NumberStyle style);

/// As find_styled_number; throws Error(bad_input) with the field where that finds none.
[[nodiscard]] double parse_styled_number(std::string_view field, NumberStyle style,
                                         std::string_view where);

/// True if a field holds a number in any style.
[[nodiscard]] bool is_number_in_some_style(std::string_view field);

/// The user's choice of a style; the rest is told by the numbers.
struct StyleChoice {
  std::optional<bool> decimal_comma;
  std::optional<ThousandsMark> thousands;
};

/// A column of a table: what to call it in messages, and where its fields stand, from the first
/// sample to the last. Missing and empty fields and texts are passed over.
struct StyledColumn {
  std::string label;
  const DelimitedRow* first = nullptr;  ///< of `rows` rows, kept as a pointer
  std::size_t rows = 0;
  std::size_t index = 0;  ///< of the field in a row
};

/// Finds the style that all columns of a file share.
///
/// A number such as 0.5, 1,25 or 1.234,5 has one reading only, and tells the decimal sign for the
/// whole file. Where all marks stand before exactly three digits ("999", then "1,002"), a column is
/// read as the smoother of its two curves, if one is clearly smoother. Throws Error(bad_input),
/// naming file, column and the options that decide, if a column fits both readings and no other
/// column tells, or if two columns contradict each other.
[[nodiscard]] NumberStyle find_number_style(std::span<const StyledColumn> columns,
                                            const StyleChoice& choice, std::string_view file);

}  // namespace tpm::files
