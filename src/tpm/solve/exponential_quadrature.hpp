#pragma once

namespace tpm {

/// Weights of the exact update of  dw/dt = (v - w)/tau  over an interval h in which v is the
/// parabola through its values at the beginning, the middle and the end:
///
///     w_new = r w + b0 v_begin + bm v_middle + b1 v_end,   z = h/tau,  r = exp(-z)
///
/// With I_k = z * integral_0^1 exp(-z (1 - s)) s^k ds:  b0 = I_0 - 3 I_1 + 2 I_2,
/// bm = 4 (I_1 - I_2), b1 = 2 I_2 - I_1. Correct to rounding for every z >= 0. The d_ values are
/// derivatives by ln(tau).
struct ParabolaWeights {
  double r, b0, bm, b1;
  double d_r, d_b0, d_bm, d_b1;
};

[[nodiscard]] ParabolaWeights parabola_weights(double z);

/// The same with v a straight line: bm = 0.
[[nodiscard]] ParabolaWeights line_weights(double z);

}  // namespace tpm
