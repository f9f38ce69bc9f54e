#include "tpm/solve/exponential_quadrature.hpp"

#include <cmath>

#include "tpm/solve/relaxation_filter.hpp"

namespace tpm {
namespace {

/// I_k and z dI_k/dz for k = 0, 1, 2.
struct Moments {
  double i0, i1, i2;
  double d0, d1, d2;
};

/// Below 1 the recursion upwards loses digits: I_2 from its series
/// I_2 = 2 z sum_j (-z)^j / (j + 3)!, then I_1 and I_0 downwards.
Moments small_moments(double z) {
  double sum = 0.0;
  double d_sum = 0.0;
  double term = 1.0 / 6.0;
  for (int j = 0; j < 18; ++j) {
    sum += term;
    d_sum += (j + 1) * term;
    term *= -z / (j + 4);
  }
  Moments m{};
  m.i2 = 2.0 * z * sum;
  m.d2 = 2.0 * z * d_sum;
  m.i1 = 0.5 * z * (1.0 - m.i2);
  m.d1 = m.i1 - 0.5 * z * m.d2;
  m.i0 = z * (1.0 - m.i1);
  m.d0 = m.i0 - z * m.d1;
  return m;
}

/// I_k = 1 - k I_{k-1}/z and its derivative.
Moments large_moments(double z) {
  const double r = std::exp(-z);
  Moments m{};
  m.i0 = 1.0 - r;
  m.d0 = r > 0.0 ? z * r : 0.0;
  m.i1 = 1.0 - m.i0 / z;
  m.d1 = (m.i0 - m.d0) / z;
  m.i2 = 1.0 - 2.0 * m.i1 / z;
  m.d2 = 2.0 * (m.i1 - m.d1) / z;
  return m;
}

}  // namespace

ParabolaWeights parabola_weights(double z) {
  const Moments m = z < 1.0 ? small_moments(z) : large_moments(z);
  // d/d ln(tau) = -z d/dz
  return {std::exp(-z),
          m.i0 - 3.0 * m.i1 + 2.0 * m.i2,
          4.0 * (m.i1 - m.i2),
          2.0 * m.i2 - m.i1,
          m.d0,
          -(m.d0 - 3.0 * m.d1 + 2.0 * m.d2),
          -4.0 * (m.d1 - m.d2),
          m.d1 - 2.0 * m.d2};
}

ParabolaWeights line_weights(double z) {
  const RelaxationWeights k = relaxation_weights(z);
  return {k.r, k.w0, 0.0, k.w1, k.d_r, k.d_w0, 0.0, k.d_w1};
}

}  // namespace tpm
