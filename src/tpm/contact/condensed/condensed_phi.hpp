#pragma once
#include <cmath>

namespace tpm::contact {

/// (1 - exp(-y))/y, and the next one: (1 - that)/y. Without loss of digits for y >= 0.
inline double first_phi(double y) {
  return y == 0.0 ? 1.0 : -std::expm1(-y) / y;
}
inline double second_phi(double y) {
  if (y > 0.05) return (1.0 - first_phi(y)) / y;
  return 0.5 - y * (1.0 / 6.0 - y * (1.0 / 24.0 - y * (1.0 / 120.0 - y / 720.0)));
}

}  // namespace tpm::contact
