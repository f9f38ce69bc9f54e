#include "tpm/organ/body/mesh_coordinate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tpm::organ {

namespace {

constexpr std::size_t kMostDecimals = 15;
constexpr std::size_t kMostWholeDigits = 18;  // 64 bits hold them
constexpr std::size_t kMostPowerDigits = 9;

std::string_view digits_at_front(std::string_view& text) {
  const auto end = std::min(text.find_first_not_of("0123456789"), text.size());
  const std::string_view digits = text.substr(0, end);
  text.remove_prefix(end);
  return digits;
}

std::uint64_t value_of(std::string_view digits) {
  std::uint64_t value = 0;
  for (const char digit : digits) value = 10 * value + static_cast<std::uint64_t>(digit - '0');
  return value;
}

/// Takes a sign from the front; true for '-'.
bool is_negative(std::string_view& text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  return negative;
}

/// 10^-n as a constant of the compiler: pow() could differ in the last bit.
constexpr std::array<double, kMostDecimals + 1> kTenths{1.0,   1e-1,  1e-2,  1e-3, 1e-4,  1e-5,
                                                        1e-6,  1e-7,  1e-8,  1e-9, 1e-10, 1e-11,
                                                        1e-12, 1e-13, 1e-14, 1e-15};

}  // namespace

std::optional<float> find_mesh_coordinate(std::string_view word) {
  const bool negative = is_negative(word);
  const std::string_view whole = digits_at_front(word);
  std::string_view decimals;
  if (word.starts_with('.') || word.starts_with(',')) {
    word.remove_prefix(1);
    decimals = digits_at_front(word);
  }
  if ((whole.empty() && decimals.empty()) || whole.size() > kMostWholeDigits) return std::nullopt;
  auto value = static_cast<float>(value_of(whole));
  decimals = decimals.substr(0, kMostDecimals);
  value += static_cast<float>(static_cast<double>(value_of(decimals)) * kTenths[decimals.size()]);
  if (word.starts_with('e') || word.starts_with('E')) {
    word.remove_prefix(1);
    const bool small = is_negative(word);
    const std::string_view power = digits_at_front(word);
    if (power.empty() || power.size() > kMostPowerDigits) return std::nullopt;
    const auto exponent = static_cast<float>(value_of(power));
    value *= std::pow(10.0F, small ? -exponent : exponent);
  }
  if (!word.empty() || !std::isfinite(value)) return std::nullopt;
  return negative ? -value : value;
}

int line_of_byte(std::string_view text, std::size_t byte) {
  int line = 1;
  for (std::size_t i = 0; i < std::min(byte, text.size()); ++i) {
    const bool pair = text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n';
    if (text[i] == '\n' || (text[i] == '\r' && !pair)) ++line;
  }
  return line;
}

}  // namespace tpm::organ
