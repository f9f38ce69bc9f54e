#pragma once
#include <cmath>
#include <string>

#include "tpm/base/text.hpp"
#include "tpmkit/error.hpp"

namespace tpm::base {

[[nodiscard]] inline bool is_positive(double value) noexcept {
  return value > 0.0 && std::isfinite(value);
}

/// Throws Error(bad_input) that says what was given and what is expected, unless it is good.
inline void require_number(bool good, std::string_view what, double given,
                           std::string_view expected, std::string_view unit = "") {
  if (!good) throw bad_input(what, shortest(given) + std::string(unit), expected);
}

}  // namespace tpm::base
