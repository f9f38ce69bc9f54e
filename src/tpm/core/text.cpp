#include "tpm/core/text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace tpm {

std::string shortest(double value) {
  return fmt::format("{}", value);
}

std::string significant(double value, int digits) {
  return fmt::format("{:.{}g}", value, digits);
}

double rounded(double value, int digits) {
  if (!std::isfinite(value)) return value;
  const std::string text = fmt::format("{:.{}e}", value, digits - 1);
  double result = value;
  std::from_chars(text.data(), text.data() + text.size(), result);
  return result;
}

std::string fixed(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

}  // namespace tpm
