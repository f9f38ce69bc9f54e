#include "tpm/law/operational_stiffness.hpp"

#include <cmath>

#include "tpm/law/kelvin_chain.hpp"

namespace tpm {
namespace {

using Complex = std::complex<double>;

}  // namespace

OperationalStiffness::OperationalStiffness(const LawSpec& spec, std::span<const double> values)
    : spec_(spec), values_(values) {
  if (spec.form != BranchForm::series) return;
  const auto n = static_cast<std::ptrdiff_t>(spec.branches);
  const auto k = values.begin() + 1;
  const ParallelWithSlopes parallel =
      to_parallel_with_slopes({values[0], {k, k + n}, {k + n, k + 2 * n}, 0.0});
  chain_ = {parallel.law.k_inf};
  chain_.insert(chain_.end(), parallel.law.k.begin(), parallel.law.k.end());
  chain_.insert(chain_.end(), parallel.law.tau_s.begin(), parallel.law.tau_s.end());
  chain_slopes_ = parallel.slopes.cast<Complex>();
}

ComplexStiffness OperationalStiffness::at(Complex log_s) const {
  return spec_.fractional != Fractional::none ? fractional(log_s) : branches(std::exp(log_s));
}

ComplexStiffness OperationalStiffness::branches(Complex s) const {
  const bool series = spec_.form == BranchForm::series;
  const std::span<const double> v = series ? std::span<const double>(chain_) : values_;
  const bool solid = series || spec_.solid;
  const Eigen::Index first = solid ? 1 : 0;
  const Eigen::Index count = spec_.branches;
  ComplexStiffness g{0.0, Eigen::RowVectorXcd::Zero(std::ssize(values_))};
  if (solid) {
    g.value = v[0];
    g.by[0] = 1.0;
  }
  for (Eigen::Index j = 0; j < count; ++j) {
    const double k = v[static_cast<std::size_t>(first + j)];
    const double tau = v[static_cast<std::size_t>(first + count + j)];
    const Complex relaxed = 1.0 / (1.0 + s * tau);
    const Complex share = s * tau * relaxed;
    g.value += k * share;
    g.by[first + j] = share;
    g.by[first + count + j] = k * share * relaxed / tau;
  }
  if (series) {
    const Eigen::Index n = chain_slopes_.rows();
    g.by.head(n) = (g.by.head(n) * chain_slopes_).eval();
  }
  return g;
}

ComplexStiffness OperationalStiffness::fractional(Complex log_s) const {
  const Fractional law = spec_.fractional;
  ComplexStiffness g{0.0, Eigen::RowVectorXcd::Zero(std::ssize(values_))};
  Eigen::Index place = 0;
  const auto value = [&](Eigen::Index i) { return values_[static_cast<std::size_t>(i)]; };
  if (has_lasting_spring(law)) {
    g.value = values_[0];
    g.by[place++] = 1.0;
  }
  const double k1 = value(place);
  if (!has_relaxation_time(law)) {
    const bool pair = law == Fractional::kelvin_voigt_pair;
    const Eigen::Index springpots = pair ? 2 : 1;
    for (Eigen::Index i = place; i < place + springpots; ++i) {
      const Complex power = std::exp(value(i + springpots) * log_s);
      g.value += value(i) * power;
      g.by[i] = power;
      g.by[i + springpots] = value(i) * power * log_s;
    }
    return g;
  }
  // Two in series, the second one a spring (beta = 0) if there is only one.
  const double tau = value(place + 1);
  const Eigen::Index at_alpha = place + 2;
  const bool pair = has_two_springpots(law);
  const double alpha = value(at_alpha);
  const double beta = pair ? value(at_alpha + 1) : 0.0;
  const Complex log_s_tau = log_s + std::log(tau);
  const Complex power = std::exp((alpha - beta) * log_s_tau);
  const Complex of_alpha = 1.0 / (1.0 + power);  // part of the first in the compliance
  const Complex of_beta = power * of_alpha;
  const Complex share = of_beta * std::exp(beta * log_s_tau);
  const Complex by_alpha = k1 * share * of_alpha;  // d/d(alpha ln(s tau))
  const Complex by_beta = k1 * share * of_beta;
  g.value += k1 * share;
  g.by[place] = share;
  g.by[place + 1] = (alpha * by_alpha + beta * by_beta) / tau;
  g.by[at_alpha] = by_alpha * log_s_tau;
  if (pair) g.by[at_alpha + 1] = by_beta * log_s_tau;
  return g;
}

}  // namespace tpm
