#include "tpm/base/printed_number.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "tpm/base/enum_names.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/units.hpp"

namespace tpm::base {
namespace {

/// Power of ten of the last digit of the part before an exponent: -2 for "0.61", 0 for "490".
int decimal_place(std::string_view mantissa) {
  const auto point = mantissa.find('.');
  return point == std::string_view::npos ? 0 : -static_cast<int>(mantissa.size() - point - 1);
}

/// 10^exponent as the nearest double, as a reader of the text would get it.
double power_of_ten(int exponent, std::string_view where) {
  return parse_number(fmt::format("1e{}", exponent), where);
}

// The recomputation itself rounds: ties within this share of the last digit count as inside.
constexpr double kTie = 1e-9;

/// @param distance (|computed| - |printed|) / u: how many last digits the recomputed value lies
///        above, away from zero
DigitVerdict classify(double distance) {
  if (std::abs(distance) <= 0.5 + kTie) return DigitVerdict::by_rounding;
  if (distance >= -kTie && distance < 1.0 - kTie) return DigitVerdict::by_truncation;
  if (distance >= -1.5 - kTie && distance < 2.0 - kTie) return DigitVerdict::last_digit_off;
  return DigitVerdict::differs;
}

}  // namespace

PrintedNumber parse_printed(std::string_view text, std::string_view where) {
  if (text.find_first_of(" \t\r\n") != std::string_view::npos) {
    throw bad_input(where, fmt::format("'{}' has white space", printable(text)),
                    "the printed digits and nothing else");
  }
  PrintedNumber number;
  number.value = parse_number(text, where);
  number.text = std::string(text);
  const auto exponent_at = text.find_first_of("eE");
  int exponent = decimal_place(text.substr(0, exponent_at));
  if (exponent_at != std::string_view::npos) {
    std::string_view tail = text.substr(exponent_at + 1);
    if (tail.starts_with('+')) tail.remove_prefix(1);
    int shift = 0;
    std::from_chars(tail.data(), tail.data() + tail.size(), shift);
    exponent += shift;
  }
  number.last_digit = power_of_ten(exponent, where);
  if (!(number.last_digit > 0.0)) {
    throw bad_input(where, fmt::format("'{}' has too many digits", printable(text)),
                    "a last digit that is worth more than 1e-308");
  }
  return number;
}

std::string percent_text(double percent) {
  const int digits = std::abs(percent) >= 99.5 ? 3 : 2;
  return fmt::format("{:+.{}g} %", percent, digits);
}

std::string percent_text(double percent, int decimals) {
  constexpr double kShown = 9.5;  // units of the last decimal
  const double shown = std::abs(percent) * std::pow(10.0, decimals);
  if (!(shown >= kShown)) return fmt::format("{:+.2g} %", percent);
  return fmt::format("{:+.{}f} %", percent, decimals);
}

std::string_view verdict_name(DigitVerdict verdict) noexcept {
  static constexpr auto kNames = std::to_array<Word<DigitVerdict>>({
      {DigitVerdict::by_rounding, "exact by rounding"},
      {DigitVerdict::by_truncation, "exact by truncation"},
      {DigitVerdict::last_digit_off, "last digit off"},
      {DigitVerdict::differs, "differs"},
  });
  return word_for(kNames, verdict);
}

std::optional<double> DigitCheck::window_percent() const noexcept {
  if (printed.value == 0.0) return std::nullopt;
  return 100.0 * window_width() / std::abs(printed.value);
}

std::string DigitCheck::words() const {
  if (verdict != DigitVerdict::differs || !difference_percent) {
    return std::string(verdict_name(verdict));
  }
  return "differs by " + percent_text(*difference_percent);
}

DigitCheck compare_digits(const PrintedNumber& printed, double computed) {
  DigitCheck check;
  check.printed = printed;
  check.computed = computed;
  const double u = printed.last_digit;
  const bool negative = std::signbit(printed.value);
  // A printed zero may stand for a small number of either sign.
  const double sign =
      printed.value == 0.0 ? (computed < 0.0 ? -1.0 : 1.0) : (negative ? -1.0 : 1.0);
  check.verdict = classify((computed - printed.value) * sign / u);
  const double near_zero = printed.value - sign * 0.5 * u;
  const double away = printed.value + sign * u;
  check.window_low = std::fmin(near_zero, away);
  check.window_high = std::fmax(near_zero, away);
  if (printed.value != 0.0) {
    check.difference_percent = 100.0 * (computed - printed.value) / std::abs(printed.value);
  }
  return check;
}

}  // namespace tpm::base
