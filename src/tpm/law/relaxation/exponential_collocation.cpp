#include "tpm/law/relaxation/exponential_collocation.hpp"

#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/special_functions/legendre.hpp>
#include <boost/math/tools/roots.hpp>
#include <cmath>

namespace tpm::law {
namespace {

/// Above this z c the asymptotic sum replaces the quadrature: it is then exact to rounding:
/// exp(-60) times the largest of its terms is below 1e-17.
constexpr double kForgotten = 60.0;

}  // namespace

std::vector<double> radau_nodes(int count) {
  // Zeros of P_s - P_(s-1) on [-1, 1], of which the last is 1.
  const auto f = [count](double x) {
    return boost::math::legendre_p(count, x) - boost::math::legendre_p(count - 1, x);
  };
  std::vector<double> nodes;
  const int cells = 4 * count * count;  // near the ends, nodes are about 4 / count^2 apart
  double left = -1.0;
  double at_left = f(left);
  for (int i = 1; i < cells; ++i) {
    const double right = -1.0 + 2.0 * i / cells;
    const double at_right = f(right);
    if (at_left * at_right < 0.0) {
      std::uintmax_t steps = 100;
      const auto [a, b] = boost::math::tools::toms748_solve(
          f, left, right, at_left, at_right, boost::math::tools::eps_tolerance<double>(52), steps);
      nodes.push_back(0.5 + 0.25 * (a + b));
    }
    left = right;
    at_left = at_right;
  }
  nodes.push_back(1.0);
  return nodes;
}

ExponentialCollocation::ExponentialCollocation(std::vector<double> nodes)
    : basis_(std::move(nodes)) {}

ExponentialCollocation::Place ExponentialCollocation::place(double c) const {
  // Gauss with 30 abscissas: to rounding for exp(-z (c - s)) times a polynomial up to z c = 60.
  using Rule = boost::math::quadrature::gauss<double, 30>;
  const auto n = static_cast<Eigen::Index>(nodes().size());
  const auto half_count = static_cast<Eigen::Index>(Rule::abscissa().size());
  Place place;
  place.c_ = c;
  place.here_ = interpolation(c);
  place.ago_.resize(2 * half_count);
  place.part_.resize(2 * half_count);
  place.shape_.resize(n, 2 * half_count);
  for (Eigen::Index i = 0; i < 2 * half_count; ++i) {
    const auto pair = static_cast<std::size_t>(i / 2);
    const double side = i % 2 == 0 ? -1.0 : 1.0;
    place.ago_[i] = 0.5 * c * (1.0 + side * Rule::abscissa()[pair]);
    place.part_[i] = 0.5 * c * Rule::weights()[pair];
    place.shape_.col(i) = interpolation(c - place.ago_[i]);
  }
  place.coefficient_ = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    auto row = place.coefficient_.row(k);
    row[0] = 1.0 / basis_.scale()[k];
    Eigen::Index degree = 0;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (j == k) continue;
      // Times c - node - a.
      const double apart = c - nodes()[static_cast<std::size_t>(j)];
      for (Eigen::Index m = ++degree; m > 0; --m) row[m] = apart * row[m] - row[m - 1];
      row[0] *= apart;
    }
  }
  return place;
}

Eigen::VectorXd ExponentialCollocation::Place::weights(double z) const {
  if (z * c_ <= kForgotten) {
    return shape_ * (z * part_.array() * (-z * ago_.array()).exp()).matrix();
  }
  return coefficient_ * asymptotic_powers(z);
}

/// z integral of a^m exp(-z a) = m!/z^m.
Eigen::VectorXd ExponentialCollocation::Place::asymptotic_powers(double z) const {
  Eigen::VectorXd power(coefficient_.cols());
  power[0] = 1.0;
  for (Eigen::Index m = 1; m < power.size(); ++m) {
    power[m] = power[m - 1] * static_cast<double>(m) / z;
  }
  return power;
}

Eigen::VectorXd ExponentialCollocation::Place::lag(double z) const {
  if (z * c_ <= kForgotten) return here_ - weights(z);
  // The first of the asymptotic terms is L_k(c) itself.
  const Eigen::Index rest = coefficient_.cols() - 1;
  return -(coefficient_.rightCols(rest) * asymptotic_powers(z).tail(rest));
}

Eigen::VectorXd ExponentialCollocation::Place::weight_slopes(double z) const {
  if (z * c_ <= kForgotten) {
    return shape_ * ((1.0 - z * ago_.array()) * part_.array() * (-z * ago_.array()).exp()).matrix();
  }
  Eigen::VectorXd power(coefficient_.cols());
  double term = 1.0;
  power[0] = 0.0;
  for (Eigen::Index m = 1; m < power.size(); ++m) {
    term *= static_cast<double>(m) / z;
    power[m] = -static_cast<double>(m) * term / z;
  }
  return coefficient_ * power;
}

}  // namespace tpm::law
