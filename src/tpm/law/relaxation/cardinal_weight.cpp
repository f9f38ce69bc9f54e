#include "tpm/law/relaxation/cardinal_weight.hpp"

#include <cmath>
#include <complex>
#include <numbers>

#include "tpm/law/relaxation/analytic.hpp"

namespace tpm::law {

namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

/// A residue below this does not count.
constexpr double kNegligible = 1e-17;
/// |alpha y|^2 below which the two terms of W are taken together. Apart they lose a digit here.
constexpr double kNearPole = 0.01;

}  // namespace

CardinalWeight::CardinalWeight(double alpha, double phase, double h)
    : spectrum_(alpha),
      h_(h),
      phase_(phase),
      pole_damping_(std::exp(-pi * spectrum_.pole_height() / h)),
      phase_cosine_(std::cos(pi * phase)),
      phase_sine_(std::sin(pi * phase)),
      pole_sine_(std::sin(spectrum_.pole_angle())),
      pole_cosine_(std::cos(spectrum_.pole_angle())) {}

SpectralValue CardinalWeight::at(long m) const {
  const double x = place(m);
  const double scaled = spectrum_.alpha() * x;
  const double angle = spectrum_.pole_angle();
  if (scaled * scaled + angle * angle < kNearPole) return near_pole(x);
  SpectralValue weight = spectrum_.density(x).times(h_);
  if (pole_damping_ > kNegligible) weight += residue(m);
  return weight;
}

SpectralValue CardinalWeight::residue(long m) const {
  const double alpha = spectrum_.alpha();
  const double x = place(m);
  // sinh and coth of alpha y by Q = exp(-2 alpha |x|), which cannot overflow
  const double root = std::exp(-alpha * std::abs(x));
  const double q = root * root;
  const double one_minus_q = 1.0 - q;
  const double side = x < 0.0 ? 1.0 : -1.0;
  const double norm = one_minus_q * one_minus_q + 4.0 * q * pole_sine_ * pole_sine_;
  const Complex inverse_sinh(side * one_minus_q * pole_cosine_, -(1.0 + q) * pole_sine_);
  const Complex coth(side * one_minus_q * (1.0 + q) / norm,
                     -4.0 * q * pole_sine_ * pole_cosine_ / norm);
  const double sign = m % 2 == 0 ? 1.0 : -1.0;
  const double size = h_ / (2.0 * pi) * sign * 4.0 * pole_damping_ * root / norm;
  const Complex term = size * inverse_sinh * Complex(phase_cosine_, -phase_sine_);
  const Complex d_y = term * (Complex(0.0, pi / h_) - alpha * coth);
  const Complex d_alpha = term * (pi * pi / (h_ * alpha * alpha) + coth * Complex(x, pi));
  return {term.imag(), d_alpha.imag(), -d_y.imag()};
}

SpectralValue CardinalWeight::near_pole(double x) const {
  // 2 (exp(i pi y/h) - 1)/sinh(v) - tanh(v/2) with v = alpha y
  const double alpha = spectrum_.alpha();
  const Complex y(-x, spectrum_.pole_height());
  const Complex turn(0.0, pi / h_);
  const Analytic mean = mean_exponential(turn * y);
  const Analytic lever = inverse_sinhc(alpha * y);
  const Complex half = std::tanh(0.5 * alpha * y);
  const Complex half_slope = 0.5 * (1.0 - half * half);
  const Complex scale = 2.0 * turn / alpha;
  const Complex value = scale * mean.value * lever.value - half;
  const Complex d_y = scale * (mean.slope * turn * lever.value + alpha * mean.value * lever.slope) -
                      alpha * half_slope;
  const Complex d_alpha_at_y =
      scale * mean.value * (y * lever.slope - lever.value / alpha) - y * half_slope;
  const Complex d_alpha = d_alpha_at_y - d_y * Complex(0.0, pi / (alpha * alpha));
  return SpectralValue{value.imag(), d_alpha.imag(), -d_y.imag()}.times(h_ / (2.0 * pi));
}

SpectralValue CardinalWeight::sum_from(long m, int direction) const {
  const double distance = direction * place(m);
  SpectralValue sum = spectrum_.sum_from(distance, h_);
  sum.d_x *= direction;
  // the residues fall off as exp(-alpha distance)
  const double falls = std::log(pole_damping_ / kNegligible) - spectrum_.alpha() * distance;
  const double count = std::ceil(falls / (spectrum_.alpha() * h_));
  for (long j = 0; static_cast<double>(j) < count; ++j) sum += residue(m + j * direction);
  return sum;
}

}  // namespace tpm::law
