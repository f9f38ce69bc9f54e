#include "tpm/law/relaxation/springpot_pair.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "tpm/law/relaxation/analytic.hpp"
#include "tpm/law/relaxation/laplace_contour.hpp"

namespace tpm::law {

namespace {

using Complex = std::complex<double>;

/// A residue below this does not count.
constexpr double kNoResidue = 1e-17;
/// |d y|^2 below which the terms of W are taken together: apart they lose a digit here.
constexpr double kPairNearPole = 0.01;
constexpr Complex kIPi(0.0, std::numbers::pi);

/// sin(pi e) for 0 <= e <= 1, exactly 0 at both ends.
double sin_pi(double e) {
  return std::sin(std::numbers::pi * std::min(e, 1.0 - e));
}

/// f(t)/t^(power - 1) at t = t_over_tau, f the inverse transform of 1/((s^-alpha + s^-beta)
/// s^power).
PairValue pair_inverse(double alpha, double beta, double power, double t_over_tau) {
  const double log_t = std::log(t_over_tau);
  PairValue sum;
  for (const ContourNode& node : contour_nodes()) {
    const Complex log_s = node.log_s - log_t;
    const Complex a = std::exp(-alpha * log_s);
    const Complex b = std::exp(-beta * log_s);
    const Complex stiffness = 1.0 / (a + b);
    const Complex term = node.weight * std::exp(-power * node.log_s) * stiffness;
    sum.value += term.real();
    sum.d_alpha += (term * stiffness * a * log_s).real();
    sum.d_beta += (term * stiffness * b * log_s).real();
    sum.d_x += (term * stiffness * (alpha * a + beta * b)).real();
  }
  return sum;
}

}  // namespace

PairValue pair_relaxation(double alpha, double beta, double t_over_tau) {
  return pair_inverse(alpha, beta, 1.0, t_over_tau);
}

PairValue pair_relaxation_mean(double alpha, double beta, double t_over_tau) {
  return pair_inverse(alpha, beta, 2.0, t_over_tau);
}

PairWeight::PairWeight(double alpha, double beta, double phase, double h)
    : exchanged_(alpha < beta),
      alpha_(std::max(alpha, beta)),
      beta_(std::min(alpha, beta)),
      gap_(alpha_ - beta_),
      h_(h),
      phase_(phase),
      pole_height_(std::numbers::pi * (1.0 - gap_) / gap_),
      pole_damping_(std::exp(-std::numbers::pi * pole_height_ / h)) {}

PairValue PairWeight::at(long m) const {
  const double x = place(m);
  const double scaled = gap_ * x;
  const double angle = std::numbers::pi * (1.0 - gap_);
  PairValue weight;
  if (scaled * scaled + angle * angle < kPairNearPole) {
    weight = near_pole(x);
  } else {
    weight = density(x).times(h_);
    if (pole_damping_ > kNoResidue) weight += residue(m);
  }
  if (exchanged_) std::swap(weight.d_alpha, weight.d_beta);
  return weight;
}

PairValue PairWeight::density(double x) const {
  using std::numbers::pi;
  // in q = exp(-d |x|), which cannot overflow
  const double side = x < 0.0 ? -1.0 : 1.0;
  const double away = std::abs(x);
  const double q = std::exp(-gap_ * away);
  const double sine_gap = sin_pi(gap_);
  const double half = std::sin(0.5 * pi * (1.0 - gap_));
  const double denominator = (1.0 - q) * (1.0 - q) + 4.0 * q * half * half;
  // q e^(beta x) and q e^(alpha x)
  const double slow = std::exp(beta_ * x - gap_ * away) / (pi * denominator);
  const double fast = std::exp(alpha_ * x - gap_ * away) / (pi * denominator);
  const double of_alpha = slow * sin_pi(alpha_);
  const double of_beta = fast * sin_pi(beta_);
  PairValue w;
  w.value = of_alpha + of_beta;
  const double fall = (1.0 - q) * (1.0 + q) / denominator;  // of w by d |x|, through q
  const double by_gap = w.value * (2.0 * pi * q * sine_gap / denominator - away * fall);
  w.d_alpha = slow * pi * std::cos(pi * alpha_) + x * of_beta + by_gap;
  w.d_beta = fast * pi * std::cos(pi * beta_) + x * of_alpha - by_gap;
  w.d_x = beta_ * of_alpha + alpha_ * of_beta - side * gap_ * fall * w.value;
  return w;
}

PairValue PairWeight::residue(long m) const {
  const double x = place(m);
  const Complex v(-gap_ * x, std::numbers::pi * (1.0 - gap_));
  // 1/sinh and coth of v by exp(-|Re v|), which cannot overflow
  const double side = x > 0.0 ? -1.0 : 1.0;
  const Complex root = std::exp(-side * v);
  const Complex rest = 1.0 - root * root;
  const Complex coth = side * (1.0 + root * root) / rest;
  const Complex turn = kIPi * (0.5 * (alpha_ + beta_) / gap_ - phase_ + (m % 2 == 0 ? 0.0 : 1.0));
  const Complex term =
      -h_ / std::numbers::pi * pole_damping_ * std::exp(turn) * (side * 2.0 * root / rest);
  const Complex d_y = kIPi / (gap_ * gap_);  // -dy/d(alpha), dy/d(beta)
  const Complex per_y = kIPi / h_;
  const Complex d_v(x, std::numbers::pi);  // -dv/d(alpha), dv/d(beta)
  const Complex shared = d_v * coth - per_y * d_y;
  PairValue c;
  c.value = term.real();
  c.d_alpha = (term * (shared - beta_ * d_y)).real();
  c.d_beta = (term * (alpha_ * d_y - shared)).real();
  c.d_x = (term * (gap_ * coth - per_y)).real();
  return c;
}

PairValue PairWeight::near_pole(double x) const {
  const Complex y(-x, pole_height_);
  const Complex per_y = kIPi / h_;
  const Analytic of_alpha = mean_exponential(-alpha_ * y);
  const Analytic of_beta = mean_exponential(-beta_ * y);
  const Analytic of_turn = mean_exponential(per_y * y);
  const Analytic lever = inverse_sinhc(gap_ * y);
  // the bracket of W over y, and its derivatives
  const Complex bracket =
      -alpha_ * of_alpha.value - beta_ * of_beta.value - 2.0 * per_y * of_turn.value;
  const Complex bracket_y = alpha_ * alpha_ * of_alpha.slope + beta_ * beta_ * of_beta.slope -
                            2.0 * per_y * per_y * of_turn.slope;
  const Complex bracket_alpha = alpha_ * y * of_alpha.slope - of_alpha.value;
  const Complex bracket_beta = beta_ * y * of_beta.slope - of_beta.value;
  const Complex d_y = kIPi / (gap_ * gap_);
  const Complex d_v = y - gap_ * d_y;  // of d y by alpha, and less by beta
  const Complex scale =
      std::exp(0.5 * kIPi * (alpha_ + beta_) / gap_) * h_ / (2.0 * std::numbers::pi * gap_);
  const Complex value = bracket * lever.value;
  const Complex by_gap =
      value * (-1.0 / gap_) + bracket * lever.slope * d_v - bracket_y * d_y * lever.value;
  PairValue w;
  w.value = (scale * value).real();
  w.d_alpha = (scale * (by_gap + bracket_alpha * lever.value - beta_ * d_y * value)).real();
  w.d_beta = (scale * (bracket_beta * lever.value - by_gap + alpha_ * d_y * value)).real();
  w.d_x = -(scale * (bracket_y * lever.value + bracket * lever.slope * gap_)).real();
  return w;
}

}  // namespace tpm::law
