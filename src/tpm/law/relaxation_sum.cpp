#include "tpm/law/relaxation_sum.hpp"

#include <cmath>
#include <initializer_list>
#include <numeric>

#include "tpmkit/error.hpp"

namespace tpm::law {
namespace {

/// So slow that only an infinite time relaxes it.
constexpr double kNever_per_s = 1e-300;

/// The two branches that stand for all rates beyond the grid: their stiffness and their viscosity
/// (stiffness over rate) add up to what is asked for.
struct FastPair {
  double first_rate;
  double second_rate;

  struct Stiffness {
    double first, second;
  };
  [[nodiscard]] Stiffness sharing(double stiffness, double viscosity) const {
    const double first =
        (viscosity - stiffness / second_rate) / (1.0 / first_rate - 1.0 / second_rate);
    return {first, stiffness - first};
  }
};

/// One column of coefficients: the slow branch, those of the grid, and the fast ones.
Eigen::VectorXd with_ends(double slow, const Eigen::VectorXd& grid,
                          const FastPair::Stiffness* fast) {
  Eigen::VectorXd all(grid.size() + (fast != nullptr ? 3 : 1));
  all[0] = slow;
  all.segment(1, grid.size()) = grid;
  if (fast != nullptr) all.tail<2>() << fast->first, fast->second;
  return all;
}

}  // namespace

RelaxationSum branch_relaxation(bool solid, int branches, std::span<const double> parallel) {
  const Eigen::Index n = branches;
  const int first = solid ? 1 : 0;
  RelaxationSum m;
  m.constant = solid ? parallel[0] : 0.0;
  m.rate_per_s.resize(n);
  m.stiffness.resize(n);
  m.by.resize(static_cast<std::size_t>(first) + static_cast<std::size_t>(branches));
  std::iota(m.by.begin(), m.by.end(), 0);
  m.d_stiffness.setZero(n, first + n);
  m.d_constant.setZero(first + n);
  m.d_dashpot.setZero(first + n);
  if (solid) m.d_constant[0] = 1.0;
  for (int j = 0; j < branches; ++j) {
    const int stiffness = first + j, time = stiffness + branches;
    m.stiffness[j] = parallel[static_cast<std::size_t>(stiffness)];
    m.rate_per_s[j] = 1.0 / parallel[static_cast<std::size_t>(time)];
    m.rate_parameter.push_back(time);
    m.d_stiffness(j, first + j) = 1.0;
  }
  return m;
}

namespace {

/// Derivative of the coefficients on the grid by a parameter.
struct GridColumn {
  int parameter;
  double scale;
  const Eigen::VectorXd& weight;
  double constant;
  double dashpot_s;
};

/// Adds one fractional element to a relaxation function: `unit` times its stiffness, and the
/// derivatives.
void add_element(RelaxationSum& m, const GridColumn& unit, std::initializer_list<GridColumn> slopes,
                 const FastPair* fast) {
  /// `total` is what the coefficients add up to at time 0
  const auto column = [&](const GridColumn& c, double total) -> Eigen::VectorXd {
    if (fast == nullptr) return with_ends(c.constant, c.weight, nullptr);
    const auto ends = fast->sharing(total - c.constant - c.weight.sum(), c.dashpot_s);
    return with_ends(c.constant, c.weight, &ends);
  };
  const Eigen::VectorXd whole = column(unit, 1.0);
  m.stiffness += unit.scale * whole;
  m.d_stiffness.col(unit.parameter) = whole;
  if (fast == nullptr) {
    m.dashpot += unit.scale * unit.dashpot_s;
    m.d_dashpot[unit.parameter] = unit.dashpot_s;
  }
  for (const GridColumn& slope : slopes) {
    m.d_stiffness.col(slope.parameter) = slope.scale * column(slope, 0.0);
    if (fast == nullptr) m.d_dashpot[slope.parameter] = slope.scale * slope.dashpot_s;
  }
}

}  // namespace

RelaxationSum fractional_relaxation(Fractional law, std::span<const double> values,
                                    const ExponentialSum& rates) {
  if (law == Fractional::none) throw bad_input("law", "not fractional", "a fractional law");
  const bool pair = has_two_springpots(law);
  const bool side_by_side = law == Fractional::kelvin_voigt_pair;
  const bool has_tau = has_relaxation_time(law);
  const int at_k1 = has_lasting_spring(law) ? 1 : 0;
  const int at_tau = at_k1 + 1;
  const int at_alpha = at_k1 + (has_tau || side_by_side ? 2 : 1);
  const int count = at_alpha + (pair ? 2 : 1);
  const auto value = [&](int i) { return values[static_cast<std::size_t>(i)]; };
  const double k1 = value(at_k1);
  const double alpha = value(at_alpha);

  const auto grid = rates.rates_per_s();
  const double beyond = grid.back() * std::exp(rates.log_step());
  const FastPair ends{beyond, 1e2 * beyond};
  const FastPair::Stiffness end_rates{ends.first_rate, ends.second_rate};
  const FastPair* fast = has_tau && !pair ? &ends : nullptr;

  RelaxationSum m;
  m.infinite_under_jump = fast == nullptr;
  m.rate_per_s =
      with_ends(kNever_per_s, Eigen::Map<const Eigen::VectorXd>(grid.data(), std::ssize(grid)),
                fast != nullptr ? &end_rates : nullptr);
  m.rate_parameter.assign(static_cast<std::size_t>(m.rate_per_s.size()), -1);
  m.by.resize(static_cast<std::size_t>(count));
  std::iota(m.by.begin(), m.by.end(), 0);
  m.stiffness.setZero(m.rate_per_s.size());
  m.d_stiffness.setZero(m.rate_per_s.size(), count);
  m.d_constant.setZero(count);
  m.d_dashpot.setZero(count);
  if (has_lasting_spring(law)) {
    m.constant = values[0];
    m.d_constant[0] = 1.0;
  }

  FractionalWeights w;
  const auto unit = [&](int parameter) {
    return GridColumn{parameter, value(parameter), w.weight, w.constant, w.dashpot_s};
  };
  const auto by_alpha = [&](int parameter, double scale) {
    return GridColumn{parameter, scale, w.d_weight_d_alpha, w.d_constant_d_alpha,
                      w.d_dashpot_d_alpha_s};
  };
  if (!has_tau) {
    rates.springpot(alpha, w);
    add_element(m, unit(at_k1), {by_alpha(at_alpha, k1)}, fast);
    if (!side_by_side) return m;
    const int at_k2 = at_k1 + 1;
    rates.springpot(value(at_alpha + 1), w);
    add_element(m, unit(at_k2), {by_alpha(at_alpha + 1, value(at_k2))}, fast);
    if (value(at_alpha + 1) == 0.0) {  // a spring: it stays for ever
      m.constant = value(at_k2);
      m.d_constant[at_k2] = 1.0;
      m.stiffness[0] -= m.constant;
      m.d_stiffness(0, at_k2) -= 1.0;
    }
    return m;
  }
  const double tau = value(at_tau);
  const auto by_tau = [&] {
    return GridColumn{at_tau, k1 / tau, w.d_weight_d_log_tau, w.d_constant_d_log_tau,
                      w.d_dashpot_d_log_tau_s};
  };
  if (!pair) {
    rates.mittag_leffler(alpha, tau, w);
    add_element(m, unit(at_k1), {by_tau(), by_alpha(at_alpha, k1)}, fast);
    return m;
  }
  rates.springpots_in_series(alpha, value(at_alpha + 1), tau, w);
  add_element(
      m, unit(at_k1),
      {by_tau(), by_alpha(at_alpha, k1),
       GridColumn{at_alpha + 1, k1, w.d_weight_d_beta, w.d_constant_d_beta, w.d_dashpot_d_beta_s}},
      fast);
  return m;
}

}  // namespace tpm::law
