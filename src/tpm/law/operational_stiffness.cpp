#include "tpm/law/operational_stiffness.hpp"

#include <algorithm>
#include <cmath>

#include "tpm/law/kelvin_chain.hpp"

namespace tpm::law {
namespace {

using Complex = std::complex<double>;

}  // namespace

OperationalStiffness::OperationalStiffness(const LawSpec& spec, std::span<const double> values)
    : spec_(spec), values_(values), exponents_(exponents()) {
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
  if (spec_.fractional == Fractional::none) return branches(std::exp(log_s));
  ComplexStiffness g;
  fractional(powers(log_s), g);
  return g;
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

OperationalStiffness::Exponents OperationalStiffness::exponents() const {
  const Fractional law = spec_.fractional;
  if (law == Fractional::none) return {};
  const std::size_t at_k1 = has_lasting_spring(law) ? 1 : 0;
  if (law == Fractional::kelvin_voigt_pair) {
    return {values_[at_k1 + 2], values_[at_k1 + 3], 0.0};
  }
  if (!has_relaxation_time(law)) return {values_[at_k1 + 1], 0.0, 0.0};
  // Two in series, the second one a spring (beta = 0) if there is only one.
  const double beta = has_two_springpots(law) ? values_[at_k1 + 3] : 0.0;
  return {values_[at_k1 + 2] - beta, beta, std::log(values_[at_k1 + 1])};
}

OperationalStiffness::Powers OperationalStiffness::powers(Complex log_s) const {
  const Complex log = log_s + exponents_.log_tau;
  return {log, std::exp(exponents_.first * log), std::exp(exponents_.second * log)};
}

OperationalStiffness::PowersOverTime::PowersOverTime(const OperationalStiffness& of, double log_t)
    : log_t_(log_t),
      first_(std::exp(-of.exponents_.first * log_t)),
      second_(std::exp(-of.exponents_.second * log_t)) {}

OperationalStiffness::Powers OperationalStiffness::PowersOverTime::operator()(
    const Powers& at_s) const {
  return {at_s.log - log_t_, first_ * at_s.first, second_ * at_s.second};
}

void OperationalStiffness::fractional(const Powers& powers, ComplexStiffness& g) const {
  const Fractional law = spec_.fractional;
  g.value = 0.0;
  g.by.setZero(std::ssize(values_));
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
      const Complex power = i == place ? powers.first : powers.second;
      g.value += value(i) * power;
      g.by[i] = power;
      g.by[i + springpots] = value(i) * power * powers.log;
    }
    return;
  }
  const double tau = value(place + 1);
  const Eigen::Index at_alpha = place + 2;
  const bool pair = has_two_springpots(law);
  const double alpha = value(at_alpha);
  const double beta = pair ? value(at_alpha + 1) : 0.0;
  const Complex of_alpha = reciprocal(1.0 + powers.first);  // part of the first in the compliance
  const Complex of_beta = powers.first * of_alpha;
  const Complex share = of_beta * powers.second;
  const Complex by_alpha = k1 * share * of_alpha;  // d/d(alpha ln(s tau))
  const Complex by_beta = k1 * share * of_beta;
  g.value += k1 * share;
  g.by[place] = share;
  g.by[place + 1] = (alpha * by_alpha + beta * by_beta) / tau;
  g.by[at_alpha] = by_alpha * powers.log;
  if (pair) g.by[at_alpha + 1] = by_beta * powers.log;
}

std::optional<ComplexStiffness> OperationalStiffness::instant() const {
  const Fractional law = spec_.fractional;
  ComplexStiffness g{0.0, Eigen::RowVectorXcd::Zero(std::ssize(values_))};
  std::size_t place = 0;
  if (has_lasting_spring(law)) {
    g.value = values_[0];
    g.by[0] = 1.0;
    place = 1;
  }
  const auto add = [&](std::size_t i, double share) {
    g.value += values_[i] * share;
    g.by[static_cast<Eigen::Index>(i)] = share;
  };
  if (has_relaxation_time(law)) {
    const double alpha = values_[place + 2];
    const double beta = has_two_springpots(law) ? values_[place + 3] : 0.0;
    if (values_[place] > 0.0 && std::min(alpha, beta) > 0.0) return std::nullopt;
    // The softer of two in series counts; two springs of equal stiffness share.
    if (std::min(alpha, beta) == 0.0) add(place, std::max(alpha, beta) > 0.0 ? 1.0 : 0.5);
    return g;
  }
  const std::size_t springpots = law == Fractional::kelvin_voigt_pair ? 2 : 1;
  for (std::size_t i = place; i < place + springpots; ++i) {
    const double order = values_[i + springpots];
    if (values_[i] > 0.0 && order > 0.0) return std::nullopt;
    if (order == 0.0) add(i, 1.0);
  }
  return g;
}

}  // namespace tpm::law
