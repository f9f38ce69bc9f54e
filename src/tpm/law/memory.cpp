#include "tpm/law/memory.hpp"

#include <cmath>
#include <numeric>

#include "tpm/core/error.hpp"

namespace tpm {
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

Memory branch_memory(bool solid, int branches, std::span<const double> parallel) {
  const Eigen::Index n = branches;
  const int first = solid ? 1 : 0;
  Memory m;
  m.constant = solid ? parallel[0] : 0.0;
  m.rate_per_s.resize(n);
  m.stiffness.resize(n);
  m.by.resize(static_cast<std::size_t>(first + branches));
  std::iota(m.by.begin(), m.by.end(), 0);
  m.d_stiffness.setZero(n, first + n);
  m.d_constant.setZero(first + n);
  m.d_dashpot.setZero(first + n);
  if (solid) m.d_constant[0] = 1.0;
  for (int j = 0; j < branches; ++j) {
    m.stiffness[j] = parallel[static_cast<std::size_t>(first + j)];
    m.rate_per_s[j] = 1.0 / parallel[static_cast<std::size_t>(first + branches + j)];
    m.rate_parameter.push_back(first + branches + j);
    m.d_stiffness(j, first + j) = 1.0;
  }
  return m;
}

Memory fractional_memory(Fractional law, std::span<const double> values,
                         const FractionalMemory& rates) {
  if (law == Fractional::none) throw bad_input("law", "not fractional", "a fractional law");
  const bool solid = law == Fractional::kelvin_voigt || law == Fractional::zener;
  const bool relaxes = law == Fractional::maxwell || law == Fractional::zener;
  const std::size_t at_k1 = solid ? 1 : 0;
  const std::size_t at_alpha = at_k1 + (relaxes ? 2 : 1);
  const double k1 = values[at_k1];
  const double alpha = values[at_alpha];
  FractionalWeights w;
  if (relaxes) {
    rates.mittag_leffler(alpha, values[at_k1 + 1], w);
  } else {
    rates.springpot(alpha, w);
  }
  const auto grid = rates.rates_per_s();
  const double beyond = grid.back() * std::exp(rates.log_step());
  const FastPair pair{beyond, 1e2 * beyond};
  /// `total` is what the coefficients add up to at time 0
  const auto column = [&](double slow, const Eigen::VectorXd& weight, double total,
                          double viscosity) {
    const auto fast = pair.sharing(total - slow - weight.sum(), viscosity);
    return with_ends(slow, weight, relaxes ? &fast : nullptr);
  };
  const Eigen::VectorXd unit = column(w.constant, w.weight, 1.0, w.dashpot_s);

  Memory m;
  const FastPair::Stiffness pair_rates{pair.first_rate, pair.second_rate};
  m.rate_per_s =
      with_ends(kNever_per_s, Eigen::Map<const Eigen::VectorXd>(grid.data(), std::ssize(grid)),
                relaxes ? &pair_rates : nullptr);
  m.stiffness = k1 * unit;
  m.rate_parameter.assign(static_cast<std::size_t>(unit.size()), -1);
  m.by.resize(at_alpha + 1);
  std::iota(m.by.begin(), m.by.end(), 0);
  m.d_stiffness.setZero(unit.size(), std::ssize(m.by));
  m.d_constant.setZero(std::ssize(m.by));
  m.d_dashpot.setZero(std::ssize(m.by));
  const auto place = [](std::size_t i) { return static_cast<Eigen::Index>(i); };
  m.d_stiffness.col(place(at_k1)) = unit;
  m.d_stiffness.col(place(at_alpha)) =
      k1 * column(w.d_constant_d_alpha, w.d_weight_d_alpha, 0.0, w.d_dashpot_d_alpha_s);
  if (relaxes) {
    m.d_stiffness.col(place(at_k1 + 1)) =
        k1 / values[at_k1 + 1] *
        column(w.d_constant_d_log_tau, w.d_weight_d_log_tau, 0.0, w.d_dashpot_d_log_tau_s);
  } else {
    m.dashpot = k1 * w.dashpot_s;
    m.d_dashpot[place(at_k1)] = w.dashpot_s;
    m.d_dashpot[place(at_alpha)] = k1 * w.d_dashpot_d_alpha_s;
  }
  if (solid) {
    m.constant = values[0];
    m.d_constant[0] = 1.0;
  }
  return m;
}

}  // namespace tpm
