#pragma once
#include <array>

namespace tpm::law {

/// Weights of the exact update of  dw/dt = (v - w)/tau  over an interval h in which v is the
/// polynomial of fourth degree through its values at 0, 1/4, 1/2, 3/4 and 1 of the interval:
///
///     w_new = r w + sum_j b[j] v_j,   z = h/tau,  r = exp(-z)
///
/// The b are combinations of the moments I_k = z * integral_0^1 exp(-z (1 - s)) s^k ds. Correct to
/// about 1e-14 for every z >= 0, also infinity. The d_ values are derivatives by ln(tau).
struct QuadratureWeights {
  double r;
  std::array<double, 5> b;
  double d_r;
  std::array<double, 5> d_b;
};

[[nodiscard]] QuadratureWeights quartic_weights(double z);

/// The same with v a straight line: b[1] to b[3] are 0.
[[nodiscard]] QuadratureWeights line_weights(double z);

}  // namespace tpm::law
