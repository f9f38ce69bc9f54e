#include "tpm/law/prony_table.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "tpm/base/evenly.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/base/text.hpp"
#include "tpm/law/relaxation/mittag_leffler.hpp"
#include "tpm/law/relaxation/nonnegative.hpp"
#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

/// The branches of a classical law, of either form.
Prony parallel_of(const LawSpec& spec, std::span<const double> values) {
  const auto n = static_cast<std::ptrdiff_t>(spec.branches);
  const bool has_first = spec.form == BranchForm::series || spec.solid;
  const auto k = values.begin() + (has_first ? 1 : 0);
  if (spec.form == BranchForm::series)
    return to_parallel({values[0], {k, k + n}, {k + n, k + 2 * n}});
  return {has_first ? values[0] : 0.0, {k, k + n}, {k + n, k + 2 * n}};
}

double relaxation_of(const Prony& law, double t_s) {
  double g = law.k_inf;
  for (std::size_t i = 0; i < law.k.size(); ++i) g += law.k[i] * std::exp(-t_s / law.tau_s[i]);
  return g;
}

/// (t/1 s)^-order / Gamma(1 - order). 1/Gamma(0) is 0: a dashpot has relaxed at every t > 0.
double springpot_relaxation(double order, double t_s) {
  return order < 1.0 ? std::pow(t_s, -order) / std::tgamma(1.0 - order) : 0.0;
}

/// Two spring-pots in series, of the stiffness 1 at 1/tau; t in units of tau.
double series_relaxation(double alpha, double beta, double t) {
  const auto [low, high] = std::minmax(alpha, beta);
  if (low == high) return 0.5 * springpot_relaxation(low, t);
  return std::pow(t, -low) *
         mittag_leffler_with_slopes(high - low, 1.0 - low, std::pow(t, high - low)).value;
}

double fractional_relaxation(Fractional law, std::span<const double> values, double t_s) {
  const std::size_t at = has_lasting_spring(law) ? 1 : 0;
  const double end = at == 1 ? values[0] : 0.0;
  if (law == Fractional::kelvin_voigt_pair) {
    return values[0] * springpot_relaxation(values[2], t_s) +
           values[1] * springpot_relaxation(values[3], t_s);
  }
  if (!has_relaxation_time(law))
    return end + values[at] * springpot_relaxation(values[at + 1], t_s);
  const double alpha = values[at + 2];
  const double t = t_s / values[at + 1];
  return end + values[at] * (has_two_springpots(law)
                                 ? series_relaxation(alpha, values[at + 3], t)
                                 : mittag_leffler(alpha, 1.0, std::pow(t, alpha)));
}

void require_window(const PronyWindow& window) {
  if (!(window.from_s > 0.0 && window.to_s > window.from_s && std::isfinite(window.to_s))) {
    throw bad_input("window",
                    fmt::format("{} s to {} s", shortest(window.from_s), shortest(window.to_s)),
                    "two rising times above 0 s");
  }
  if (window.times < 0 || window.times > 50) {
    throw bad_input("window", fmt::format("{} relaxation times", window.times), "1 to 50");
  }
}

/// The branches, with a constant for what the window does not see relax.
Prony fit_branches(const LawSpec& spec, std::span<const double> values, const PronyWindow& window) {
  require_window(window);
  const double decades = std::log10(window.to_s / window.from_s);
  const int count = window.times > 0
                        ? window.times
                        : std::min(50, static_cast<int>(std::lround(2.0 * decades)) + 1);
  const std::vector<double> taus = evenly_in_log(window.from_s, window.to_s, count);
  const std::vector<double> times = evenly_in_log(window.from_s, window.to_s, 40 * (count + 1));
  Eigen::MatrixXd shape(std::ssize(times), count + 1);
  for (Eigen::Index i = 0; i < shape.rows(); ++i) {
    const double t = times[static_cast<std::size_t>(i)];
    const double g = relaxation_stiffness(spec, values, t);
    if (!(g > 0.0)) throw bad_input("export", "the law has no stiffness in the window");
    shape(i, 0) = 1.0 / g;
    for (Eigen::Index j = 0; j < count; ++j) {
      shape(i, j + 1) = std::exp(-t / taus[static_cast<std::size_t>(j)]) / g;
    }
  }
  const Eigen::VectorXd x = nonnegative_least_squares(shape, Eigen::VectorXd::Ones(shape.rows()));
  return {x[0], {x.data() + 1, x.data() + x.size()}, taus};
}

double worst_error(const PronyTable& table, const LawSpec& spec, std::span<const double> values) {
  double worst = 0.0;
  for (const double t : evenly_in_log(table.from_s, table.to_s, 2001)) {
    worst = std::max(worst, std::abs(table.at(t) / relaxation_stiffness(spec, values, t) - 1.0));
  }
  return worst;
}

PronyTable normalised(const Prony& law) {
  PronyTable table;
  table.instant = relaxation_of(law, 0.0);
  if (!(table.instant > 0.0)) throw bad_input("export", "the law has no stiffness");
  table.long_share = law.k_inf / table.instant;
  std::vector<std::size_t> order(law.k.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return law.tau_s[a] < law.tau_s[b]; });
  for (const std::size_t i : order) {
    if (!(law.k[i] > 0.0)) continue;
    table.g.push_back(law.k[i] / table.instant);
    table.tau_s.push_back(law.tau_s[i]);
  }
  return table;
}

}  // namespace

double PronyTable::at(double t_s) const {
  double share = long_share;
  for (std::size_t i = 0; i < g.size(); ++i) share += g[i] * std::exp(-t_s / tau_s[i]);
  return instant * share;
}

double relaxation_stiffness(const LawSpec& spec, std::span<const double> values, double t_s) {
  return spec.fractional != Fractional::none ? fractional_relaxation(spec.fractional, values, t_s)
                                             : relaxation_of(parallel_of(spec, values), t_s);
}

PronyTable prony_table(const LawSpec& spec, std::span<const double> values,
                       const PronyWindow& window) {
  if (spec.fractional == Fractional::none) return normalised(parallel_of(spec, values));
  PronyTable table = normalised(fit_branches(spec, values, window));
  table.fitted = true;
  table.from_s = window.from_s;
  table.to_s = window.to_s;
  table.worst_relative_error = worst_error(table, spec, values);
  return table;
}

}  // namespace tpm::law
