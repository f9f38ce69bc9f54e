#include "tpm/law/relaxation/exponential_quadrature.hpp"

#include <cmath>

#include "tpm/law/relaxation/relaxation_filter.hpp"

namespace tpm::law {
namespace {

/// I_k and z dI_k/dz for k = 0 to 4.
struct Moments {
  std::array<double, 5> i;
  std::array<double, 5> d;
};

/// The recursion I_k = 1 - k I_{k-1}/z loses digits upwards while z is small: there I_4 comes from
/// its series I_4 = 4! z sum_j (-z)^j / (j + 5)! and the others downwards.
Moments small_moments(double z) {
  double sum = 0.0;
  double d_sum = 0.0;
  double term = 0.2;  // 4!/5!
  for (int j = 0; j < 40; ++j) {
    sum += term;
    d_sum += (j + 1) * term;
    term *= -z / (j + 6);
    if (std::abs(term) * (j + 2) < 1e-18) break;
  }
  Moments m{};
  m.i[4] = z * sum;
  m.d[4] = z * d_sum;
  for (std::size_t k = 4; k > 0; --k) {
    const double share = z / static_cast<double>(k);
    m.i[k - 1] = share * (1.0 - m.i[k]);
    m.d[k - 1] = m.i[k - 1] - share * m.d[k];
  }
  return m;
}

Moments large_moments(double z) {
  const double r = std::exp(-z);
  Moments m{};
  m.i[0] = 1.0 - r;
  m.d[0] = r > 0.0 ? z * r : 0.0;
  for (std::size_t k = 1; k < 5; ++k) {
    const double share = static_cast<double>(k) / z;
    m.i[k] = 1.0 - share * m.i[k - 1];
    m.d[k] = share * (m.i[k - 1] - m.d[k - 1]);
  }
  return m;
}

/// Lagrange polynomials of the nodes x = 0, 1, 2, 3, 4 in powers of x, times 24.
constexpr std::array<std::array<double, 5>, 5> kLagrange{{{24.0, -50.0, 35.0, -10.0, 1.0},
                                                          {0.0, 96.0, -104.0, 36.0, -4.0},
                                                          {0.0, -72.0, 114.0, -48.0, 6.0},
                                                          {0.0, 32.0, -56.0, 28.0, -4.0},
                                                          {0.0, -6.0, 11.0, -6.0, 1.0}}};

/// sum over powers of the polynomials times moments of x = 4 s.
std::array<double, 5> node_weights(const std::array<double, 5>& moments) {
  std::array<double, 5> weights{};
  for (std::size_t j = 0; j < 5; ++j) {
    double power = 1.0 / 24.0;
    for (std::size_t k = 0; k < 5; ++k) {
      weights[j] += kLagrange[j][k] * power * moments[k];
      power *= 4.0;
    }
  }
  return weights;
}

}  // namespace

QuadratureWeights quartic_weights(double z) {
  // Upwards each step multiplies the error by k/z: from 4 on it shrinks.
  const Moments m = z < 4.0 ? small_moments(z) : large_moments(z);
  QuadratureWeights weights{std::exp(-z), node_weights(m.i), m.d[0], node_weights(m.d)};
  for (double& d : weights.d_b) d = -d;  // d/d ln(tau) = -z d/dz
  return weights;
}

QuadratureWeights line_weights(double z) {
  const RelaxationWeights k = relaxation_weights(z);
  return {k.r, {k.w0, 0.0, 0.0, 0.0, k.w1}, k.d_r, {k.d_w0, 0.0, 0.0, 0.0, k.d_w1}};
}

}  // namespace tpm::law
