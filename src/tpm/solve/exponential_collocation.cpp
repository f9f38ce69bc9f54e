#include "tpm/solve/exponential_collocation.hpp"

#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/legendre.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>

namespace tpm {
namespace {

/// z * integral_0^c exp(-z (c - s)) s^p ds for p = 0, 1, ..., size - 1.
Eigen::VectorXd moments(double c, double z, Eigen::Index size) {
  Eigen::VectorXd moment = Eigen::VectorXd::Zero(size);
  if (z * c > 2.0 * static_cast<double>(size)) {
    // Rising recurrence: each step damps the error of the one before.
    moment[0] = -std::expm1(-z * c);
    double power = 1.0;
    for (Eigen::Index p = 1; p < size; ++p) {
      power *= c;
      moment[p] = power - static_cast<double>(p) / z * moment[p - 1];
    }
    return moment;
  }
  using Rule = boost::math::quadrature::gauss<double, 30>;
  const auto add = [&](double abscissa, double weight) {
    const double s = 0.5 * c * (1.0 + abscissa);
    double term = 0.5 * c * weight * z * std::exp(-z * (c - s));
    for (Eigen::Index p = 0; p < size; ++p, term *= s) moment[p] += term;
  };
  for (std::size_t i = 0; i < Rule::abscissa().size(); ++i) {
    add(Rule::abscissa()[i], Rule::weights()[i]);
    add(-Rule::abscissa()[i], Rule::weights()[i]);
  }
  return moment;
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
    : nodes_(std::move(nodes)) {
  const auto n = static_cast<Eigen::Index>(nodes_.size());
  coefficients_ = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double own = nodes_[static_cast<std::size_t>(k)];
    Eigen::VectorXd row = Eigen::VectorXd::Unit(n, 0);
    Eigen::Index degree = 0;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (j == k) continue;
      const double other = nodes_[static_cast<std::size_t>(j)];
      // Times (c - other) / (own - other).
      for (Eigen::Index p = ++degree; p >= 0; --p) {
        row[p] = ((p > 0 ? row[p - 1] : 0.0) - other * row[p]) / (own - other);
      }
    }
    coefficients_.row(k) = row.transpose();
  }
}

Eigen::VectorXd ExponentialCollocation::weights(double c, double z) const {
  return coefficients_ * moments(c, z, coefficients_.cols());
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
