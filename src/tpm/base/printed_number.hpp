#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace tpm::base {

/// A number as a paper prints it. Its digits say how well it is known: "0.61" has a last digit
/// worth 0.01, "1.2e-3" one worth 0.0001, "490" one worth 1 (a final zero counts as a digit).
struct PrintedNumber {
  std::string text;
  double value = 0.0;
  double last_digit = 1.0;  ///< value of one unit of the last printed digit, > 0
};

/// Reads a decimal number with optional sign, point and exponent, and nothing else.
/// Throws Error(bad_input) for anything else (nan, inf, hexadecimal, an overflow, no digits).
[[nodiscard]] PrintedNumber parse_printed(std::string_view text, std::string_view where);

/// A difference in percent in the way people write it: "+0.82 %", "-34 %", "-100 %".
[[nodiscard]] std::string percent_text(double percent);
/// With so many decimals, and two significant digits where these show fewer: "-12.3 %", "+0.012 %".
[[nodiscard]] std::string percent_text(double percent, int decimals);

/// Relation of a recomputed number to the printed digits.
enum class DigitVerdict {
  by_rounding,     ///< rounding gives the printed digits
  by_truncation,   ///< only cutting the digits off gives them
  last_digit_off,  ///< rounding or truncation gives a neighbour of the printed last digit
  differs,         ///< further away
};

/// "exact by rounding", "exact by truncation", "last digit off", "differs".
[[nodiscard]] std::string_view verdict_name(DigitVerdict verdict) noexcept;

/// A printed number compared with a recomputed one, both in the printed unit.
///
/// With v the printed value and u the worth of its last digit, rounding explains the interval
/// [v - u/2, v + u/2] and truncation [v, v + u) (mirrored for negative numbers). The window is
/// their union, 1.5 u wide: a number printed with few digits is explained by a wide window, so its
/// width travels with every verdict.
struct DigitCheck {
  PrintedNumber printed;
  double computed = 0.0;
  DigitVerdict verdict = DigitVerdict::differs;
  double window_low = 0.0;
  double window_high = 0.0;
  /// (computed - printed) / |printed| in percent; none if 0 is printed
  std::optional<double> difference_percent;

  [[nodiscard]] bool explained() const noexcept {
    return verdict == DigitVerdict::by_rounding || verdict == DigitVerdict::by_truncation;
  }
  [[nodiscard]] double window_width() const noexcept { return window_high - window_low; }
  /// Width of the window relative to the printed value in percent; none if 0 is printed.
  [[nodiscard]] std::optional<double> window_percent() const noexcept;
  /// The verdict in words, with the difference where there is one: "differs by -1.3 %".
  [[nodiscard]] std::string words() const;
};

/// @param computed finite, in the unit in which the number is printed
[[nodiscard]] DigitCheck compare_digits(const PrintedNumber& printed, double computed);

}  // namespace tpm::base
