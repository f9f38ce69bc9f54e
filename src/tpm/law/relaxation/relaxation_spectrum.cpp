#include "tpm/law/relaxation/relaxation_spectrum.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace tpm::law {

namespace {

using std::numbers::pi;

/// Weights of w(x + (j - 1/2) h) - w(x - (j - 1/2) h), j = 1 .. 4, in the difference between the
/// midpoint sum from x + h/2 on and the integral from x on: Gauss's central differences with the
/// coefficients 1/24, -17/5760, 367/967680, -27859/464486400, written out by node.
constexpr std::array<double, 4> kEdgeWeights = [] {
  constexpr double d1 = 1.0 / 24.0;
  constexpr double d3 = -17.0 / 5760.0;
  constexpr double d5 = 367.0 / 967680.0;
  constexpr double d7 = -27859.0 / 464486400.0;
  return std::array<double, 4>{d1 - 3.0 * d3 + 10.0 * d5 - 35.0 * d7, d3 - 5.0 * d5 + 21.0 * d7,
                               d5 - 7.0 * d7, d7};
}();

}  // namespace

RelaxationSpectrum::RelaxationSpectrum(double alpha)
    : alpha_(alpha),
      pole_angle_(pi * (1.0 - alpha)),
      pole_height_(pole_angle_ / alpha),
      sine_(alpha > 0.5 ? std::sin(pole_angle_) : std::sin(pi * alpha)),
      cosine_(std::cos(pi * alpha)),
      gap_(2.0 * std::pow(std::sin(0.5 * pole_angle_), 2)) {}

SpectralValue RelaxationSpectrum::density(double x) const {
  // in q = exp(-alpha |x|), which cannot overflow
  const double q = std::exp(-alpha_ * std::abs(x));
  const double one_minus_q = 1.0 - q;
  const double denominator = one_minus_q * one_minus_q + 2.0 * q * gap_;
  const double scale = 1.0 / (pi * denominator);
  const double d_q = sine_ * one_minus_q * (1.0 + q) * scale / denominator;
  const double d_angle = q * (cosine_ * (1.0 + q * q) + 2.0 * q) / (denominator * denominator);
  SpectralValue w;
  w.value = sine_ * q * scale;
  w.d_alpha = d_angle - std::abs(x) * q * d_q;
  w.d_x = (x > 0.0 ? -alpha_ : alpha_) * q * d_q;
  return w;
}

SpectralValue RelaxationSpectrum::beyond(double x) const {
  // below the peak, where exp(-alpha x) may overflow, by the symmetry of w
  if (x < 0.0) {
    const SpectralValue other = beyond(-x);
    return {1.0 - other.value, -other.d_alpha, other.d_x};
  }
  const double q = std::exp(-alpha_ * x);
  SpectralValue integral;
  integral.value = std::atan2(q * sine_, 1.0 + q * cosine_) / (pi * alpha_);
  const double norm = 1.0 + 2.0 * q * cosine_ + q * q;
  const double d_angle = q * (pi * (q + cosine_) - x * sine_) / norm;
  integral.d_alpha = d_angle / (pi * alpha_) - integral.value / alpha_;
  integral.d_x = -sine_ * q / (pi * norm);
  return integral;
}

SpectralValue RelaxationSpectrum::sum_from(double x, double h) const {
  const double edge = x - 0.5 * h;
  SpectralValue sum = beyond(edge);
  double away = 0.5 * h;
  for (const double weight : kEdgeWeights) {
    sum += density(edge + away).times(h * weight);
    sum += density(edge - away).times(-h * weight);
    away += h;
  }
  return sum;
}

}  // namespace tpm::law
