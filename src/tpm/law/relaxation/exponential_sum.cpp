#include "tpm/law/relaxation/exponential_sum.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/cardinal_weight.hpp"
#include "tpm/law/relaxation/springpot_pair.hpp"
#include "tpmkit/error.hpp"

namespace tpm::law {

namespace {

using std::numbers::pi;

/// A number with its derivative by one argument.
struct Sloped {
  double value;
  double slope;
};

[[noreturn]] void refuse(std::string_view what, double value, std::string_view expected) {
  throw bad_input("exponential sum", fmt::format("{} = {}", what, shortest(value)), expected);
}

void check_alpha(double alpha) {
  if (!(alpha > 0.0 && alpha <= 1.0)) refuse("alpha", alpha, "0 < alpha <= 1");
}

void check_order(const char* name, double order) {
  if (!(order >= 0.0 && order <= 1.0)) refuse(name, order, "0 to 1");
}

void check_tau(double tau_s) {
  if (!(tau_s > 0.0 && std::isfinite(tau_s))) refuse("tau", tau_s, "a time > 0 s");
}

void check_window(double t_min_s, double t_max_s, double tolerance) {
  if (!(t_min_s > 0.0 && std::isfinite(t_min_s))) refuse("t_min", t_min_s, "a time > 0 s");
  if (!(t_max_s >= t_min_s && std::isfinite(t_max_s))) {
    refuse("t_max", t_max_s, fmt::format("a time of at least t_min = {} s", shortest(t_min_s)));
  }
  if (!(tolerance >= 1e-12 && tolerance <= 1e-3)) refuse("tolerance", tolerance, "1e-12 to 1e-3");
}

/// sin(pi e)/(pi e) by e, for 0 <= e <= 1; exactly 0 at e = 1.
Sloped sinc_pi(double e) {
  const double u = pi * e;
  if (e > 0.2) {
    const double value = std::sin(pi * std::min(e, 1.0 - e)) / u;
    return {value, (std::cos(u) - value) / e};
  }
  Sloped sum{1.0, 0.0};  // 1 - u^2/(2 3) (1 - u^2/(4 5) (1 - ...)), slope by u
  for (int n = 16; n >= 2; n -= 2) {
    const double ratio = -1.0 / (n * (n + 1.0));
    sum.slope = ratio * (2.0 * u * sum.value + u * u * sum.slope);
    sum.value = 1.0 + ratio * u * u * sum.value;
  }
  return {sum.value, pi * sum.slope};
}

/// z/(exp(z) - 1) by z, for 0 <= z < 0.7, from the Bernoulli numbers.
Sloped bernoulli(double z) {
  constexpr std::array<double, 8> kSeries{1.0 / 12.0,          -1.0 / 720.0,
                                          1.0 / 30240.0,       -1.0 / 1209600.0,
                                          1.0 / 47900160.0,    -691.0 / 1307674368000.0,
                                          1.0 / 74724249600.0, -3617.0 / 10670622842880000.0};
  Sloped sum{1.0 - 0.5 * z, -0.5};
  double power = z;
  for (std::size_t n = 0; n < kSeries.size(); ++n) {
    sum.slope += 2.0 * static_cast<double>(n + 1) * kSeries[n] * power;
    sum.value += kSeries[n] * power * z;
    power *= z * z;
  }
  return sum;
}

/// The sum over j >= 1 of h sin(pi e)/pi exp(-e (edge + j h)): all of the spring-pot's spectrum
/// beyond an edge of the grid. 1 at e = 0.
Sloped springpot_beyond(double e, double edge, double h) {
  const Sloped a = sinc_pi(e);
  const Sloped b = bernoulli(e * h);
  const double c = std::exp(-e * edge);
  return {a.value * b.value * c,
          (a.slope * b.value + h * a.value * b.slope - edge * a.value * b.value) * c};
}

/// The sum of exp(-j h) W(m + (j - 1) direction), j = 1, 2, ...: rates beyond an edge of the grid
/// by their rate (or time) relative to that of the edge.
template <class Weight>
auto damped_sum(const Weight& weight, long m, int direction, std::span<const double> damping) {
  decltype(weight.at(m)) sum;
  for (const double factor : damping) {
    sum += weight.at(m).times(factor);
    m += direction;
  }
  return sum;
}

/// The weights of the nodes from `first` on, one for each rate. Returns their sum.
SpectralValue fill(const CardinalWeight& weight, long first, FractionalWeights& out) {
  SpectralValue sum;
  for (Eigen::Index i = 0; i < out.weight.size(); ++i) {
    const SpectralValue w = weight.at(first + i);
    out.weight[i] = w.value;
    out.d_weight_d_alpha[i] = w.d_alpha;
    out.d_weight_d_log_tau[i] = w.d_x;
    sum += w;
  }
  return sum;
}

/// The sum of all weights below the grid. As all weights add up to 1, only the end of the grid that
/// is farther from the peak of the spectrum needs to be summed beyond.
SpectralValue sum_below(const CardinalWeight& weight, long first, long last,
                        const SpectralValue& inside) {
  if (-weight.place(first) > weight.place(last)) return weight.sum_from(first - 1, -1);
  SpectralValue rest{1.0, 0.0, 0.0};
  rest += inside.times(-1.0);
  rest += weight.sum_from(last + 1, 1).times(-1.0);
  return rest;
}

}  // namespace

// The tolerance is spent by halves: one on the step (error exp(-pi^2/(2h)), reached at alpha = 1),
// a quarter on each end of the grid.
double ExponentialSum::log_step_for(double tolerance) {
  return pi * pi / (2.0 * std::log(2.0 / tolerance));
}

ExponentialSum::ExponentialSum(double t_min_s, double t_max_s, double tolerance)
    : t_min_s_(t_min_s), t_max_s_(t_max_s) {
  check_window(t_min_s, t_max_s, tolerance);
  step_ = log_step_for(tolerance);
  // Slower rates as a constant and the first rate: (r t)^2/8 at most.
  const double slowest = std::sqrt(2.0 * tolerance) / t_max_s;
  // Faster rates are over within t_min; for the spring-pot exp(-r t) (r t)^alpha has to be small.
  const double decades = std::log(4.0 / tolerance);
  const double fastest = (decades + std::log(decades)) / t_min_s;
  first_ = std::lround(std::floor(std::log(slowest) / step_));
  const long last = std::lround(std::ceil(std::log(fastest) / step_));
  for (long k = first_; k <= last; ++k) {
    rates_.push_back(std::exp(static_cast<double>(k) * step_));
  }
  for (int j = 1; std::exp(-j * step_) > tolerance; ++j) {
    damping_.push_back(std::exp(-j * step_));
  }
  stated_error_ = tolerance;
}

void ExponentialSum::prepare(FractionalWeights& out) const {
  const auto n = static_cast<Eigen::Index>(rates_.size());
  out.weight.resize(n);
  out.d_weight_d_alpha.resize(n);
  out.d_weight_d_beta.setZero(n);
  out.d_weight_d_log_tau.setZero(n);
  out.d_constant_d_beta = out.d_constant_d_log_tau = 0.0;
  out.d_dashpot_d_beta_s = out.d_dashpot_d_log_tau_s = 0.0;
}

void ExponentialSum::mittag_leffler(double alpha, double tau_s, FractionalWeights& out) const {
  check_alpha(alpha);
  check_tau(tau_s);
  prepare(out);
  const double steps = std::log(tau_s) / step_;
  const double whole = std::nearbyint(steps);
  const CardinalWeight weight(alpha, steps - whole, step_);
  const long first = first_ + std::lround(whole);
  const long last = first + std::ssize(rates_) - 1;

  const SpectralValue inside = fill(weight, first, out);
  const SpectralValue below = sum_below(weight, first, last, inside);
  const SpectralValue on_first = damped_sum(weight, first - 1, -1, damping_);
  out.weight[0] += on_first.value;
  out.d_weight_d_alpha[0] += on_first.d_alpha;
  out.d_weight_d_log_tau[0] += on_first.d_x;
  out.constant = below.value - on_first.value;
  out.d_constant_d_alpha = below.d_alpha - on_first.d_alpha;
  out.d_constant_d_log_tau = below.d_x - on_first.d_x;

  const SpectralValue fast = damped_sum(weight, last + 1, 1, damping_).times(1.0 / rates_.back());
  out.dashpot_s = fast.value;
  out.d_dashpot_d_alpha_s = fast.d_alpha;
  out.d_dashpot_d_log_tau_s = fast.d_x;
}

void ExponentialSum::springpot(double alpha, FractionalWeights& out) const {
  check_order("alpha", alpha);
  prepare(out);
  const double rest = 1.0 - alpha;
  const double sine = std::sin(pi * std::min(alpha, rest));  // exactly 0 at alpha = 1
  const double cosine = std::cos(pi * alpha);
  for (Eigen::Index i = 0; i < out.weight.size(); ++i) {
    const double x = step_ * static_cast<double>(first_ + i);
    const double power = step_ * std::exp(alpha * x);
    out.weight[i] = sine / pi * power;
    out.d_weight_d_alpha[i] = (cosine + sine / pi * x) * power;
  }
  const double first_x = step_ * static_cast<double>(first_);
  const double last_x = first_x + step_ * static_cast<double>(rates_.size() - 1);

  const Sloped below = springpot_beyond(alpha, -first_x, step_);
  const double growth = std::expm1((1.0 + alpha) * step_);
  const double on_first = out.weight[0] / growth;
  const double d_on_first = (out.d_weight_d_alpha[0] - on_first * step_ * (growth + 1.0)) / growth;
  out.weight[0] += on_first;
  out.d_weight_d_alpha[0] += d_on_first;
  out.constant = below.value - on_first;
  out.d_constant_d_alpha = below.slope - d_on_first;

  const Sloped fast = springpot_beyond(rest, last_x, step_);
  out.dashpot_s = fast.value;
  out.d_dashpot_d_alpha_s = -fast.slope;
}

void ExponentialSum::springpots_in_series(double alpha, double beta, double tau_s,
                                          FractionalWeights& out) const {
  check_order("alpha", alpha);
  check_order("beta", beta);
  check_tau(tau_s);
  prepare(out);
  const double steps = std::log(tau_s) / step_;
  const double whole = std::nearbyint(steps);
  const PairWeight weight(alpha, beta, steps - whole, step_);
  const long first = first_ + std::lround(whole);
  // Remainder of G(t_max), and of the integral over [0, t_min], beyond the sum of the rates.
  PairValue constant = pair_relaxation(alpha, beta, t_max_s_ / tau_s);
  PairValue dashpot = pair_relaxation_mean(alpha, beta, t_min_s_ / tau_s).times(t_min_s_);
  for (std::size_t j = 0; j < rates_.size(); ++j) {
    PairValue w = weight.at(first + static_cast<long>(j));
    if (j == 0) w += damped_sum(weight, first - 1, -1, damping_);
    const auto i = static_cast<Eigen::Index>(j);
    out.weight[i] = w.value;
    out.d_weight_d_alpha[i] = w.d_alpha;
    out.d_weight_d_beta[i] = w.d_beta;
    out.d_weight_d_log_tau[i] = w.d_x;
    constant += w.times(-std::exp(-rates_[j] * t_max_s_));
    dashpot += w.times(std::expm1(-rates_[j] * t_min_s_) / rates_[j]);
  }
  dashpot += constant.times(-t_min_s_);
  out.constant = constant.value;
  out.d_constant_d_alpha = constant.d_alpha;
  out.d_constant_d_beta = constant.d_beta;
  out.d_constant_d_log_tau = constant.d_x;
  out.dashpot_s = dashpot.value;
  out.d_dashpot_d_alpha_s = dashpot.d_alpha;
  out.d_dashpot_d_beta_s = dashpot.d_beta;
  out.d_dashpot_d_log_tau_s = dashpot.d_x;
}

}  // namespace tpm::law
