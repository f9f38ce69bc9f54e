#include "tpm/core/text.hpp"

#include <fmt/format.h>

namespace tpm {

std::string shortest(double value) {
  return fmt::format("{}", value);
}

std::string significant(double value, int digits) {
  return fmt::format("{:.{}g}", value, digits);
}

std::string fixed(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

}  // namespace tpm
