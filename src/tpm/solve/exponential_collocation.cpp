#include "tpm/solve/exponential_collocation.hpp"

#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/legendre.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>

namespace tpm {
namespace {

/// z times an interval behind which exp(-z s) is below rounding.
constexpr double kForgotten = 40.0;

/// Visits the abscissas s in (0, c) and weights of a quadrature of exp(-z (c - s)) times a
/// polynomial, 1e-16 for degrees up to 10: Gauss over what is not forgotten.
template <class Visit>
void quadrature(double c, double z, Visit&& visit) {
  using Rule = boost::math::quadrature::gauss<double, 30>;
  const double half = 0.5 * (z * c > kForgotten ? kForgotten / z : c);
  for (std::size_t i = 0; i < Rule::abscissa().size(); ++i) {
    for (const double side : {-1.0, 1.0}) {
      const double ago = half * (1.0 + side * Rule::abscissa()[i]);
      visit(c - ago, half * Rule::weights()[i] * std::exp(-z * ago));
    }
  }
}

}  // namespace

std::vector<double> radau_nodes(int count) {
  // Zeros of P_s - P_(s-1) on [-1, 1], of which the last is 1.
  const auto f = [count](double x) {
    return boost::math::legendre_p(count, x) - boost::math::legendre_p(count - 1, x);
  };
  std::vector<double> nodes;
  constexpr int kCells = 400;
  double left = -1.0;
  for (int i = 1; i < kCells; ++i) {
    const double right = -1.0 + 2.0 * i / kCells;
    if (f(left) * f(right) < 0.0) {
      std::uintmax_t steps = 100;
      const auto [a, b] = boost::math::tools::toms748_solve(
          f, left, right, boost::math::tools::eps_tolerance<double>(52), steps);
      nodes.push_back(0.5 + 0.25 * (a + b));
    }
    left = right;
  }
  nodes.push_back(1.0);
  return nodes;
}

ExponentialCollocation::ExponentialCollocation(std::vector<double> nodes)
    : nodes_(std::move(nodes)) {}

Eigen::VectorXd ExponentialCollocation::weights(double c, double z) const {
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(nodes_.size()));
  quadrature(c, z, [&](double s, double part) { weight += z * part * interpolation(s); });
  return weight;
}

Eigen::VectorXd ExponentialCollocation::weight_slopes(double c, double z) const {
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(nodes_.size()));
  quadrature(
      c, z, [&](double s, double part) { slope += (1.0 - z * (c - s)) * part * interpolation(s); });
  return slope;
}

Eigen::VectorXd ExponentialCollocation::interpolation(double c) const {
  // As products: powers of c would cancel.
  const auto n = nodes_.size();
  Eigen::VectorXd values = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(n));
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t j = 0; j < n; ++j) {
      if (j == k) continue;
      values[static_cast<Eigen::Index>(k)] *= (c - nodes_[j]) / (nodes_[k] - nodes_[j]);
    }
  }
  return values;
}

}  // namespace tpm
