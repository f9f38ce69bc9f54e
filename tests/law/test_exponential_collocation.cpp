#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tpm/law/relaxation/exponential_collocation.hpp"

using namespace tpm;
using namespace tpm::law;

namespace {

std::vector<double> from_start(int stages) {
  std::vector<double> nodes = radau_nodes(stages);
  nodes.insert(nodes.begin(), 0.0);
  return nodes;
}

Eigen::VectorXd powers_at(const std::vector<double>& nodes, int power) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(nodes.size()));
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    values[k] = std::pow(nodes[static_cast<std::size_t>(k)], power);
  }
  return values;
}

/// z integral_0^c s^power exp(-z (c - s)) ds: by parts where that does not cancel, else by the
/// series of exp(-z c) times the integral of s^power exp(z s).
double followed(int power, double c, double z) {
  if (z * c < 1.0) {
    double term = z * std::pow(c, power + 1), sum = 0.0;
    for (int i = 0; i < 40; ++i) {
      sum += term / (power + 1 + i);
      term *= z * c / (i + 1);
    }
    return std::exp(-z * c) * sum;
  }
  double value = -std::expm1(-z * c);
  for (int m = 1; m <= power; ++m) value = std::pow(c, m) - m / z * value;
  return value;
}

}  // namespace

TEST_CASE("Radau's nodes integrate polynomials exactly up to twice their number less two") {
  for (const int stages : {1, 2, 3, 5, 8}) {
    const std::vector<double> nodes = radau_nodes(stages);
    REQUIRE(nodes.size() == static_cast<std::size_t>(stages));
    CHECK(nodes.back() == 1.0);
    // Weights from the powers below the number of nodes; the powers above judge the nodes.
    const auto n = static_cast<Eigen::Index>(stages);
    Eigen::MatrixXd vandermonde(n, n);
    Eigen::VectorXd integral(n);
    for (Eigen::Index m = 0; m < n; ++m) {
      vandermonde.row(m) = powers_at(nodes, static_cast<int>(m)).transpose();
      integral[m] = 1.0 / static_cast<double>(m + 1);
    }
    const Eigen::VectorXd weights = vandermonde.fullPivLu().solve(integral);
    for (int power = 0; power <= 2 * stages - 2; ++power) {
      INFO(stages << " stages, power " << power);
      CHECK(weights.dot(powers_at(nodes, power)) == Approx(1.0 / (power + 1)).epsilon(1e-12));
    }
  }
}

TEST_CASE("Interpolation is exact for polynomials, and at a node it is that node's value alone") {
  for (const int stages : {2, 5, 8}) {
    const ExponentialCollocation collocation(from_start(stages));
    for (std::size_t k = 0; k < collocation.nodes().size(); ++k) {
      const Eigen::VectorXd at = collocation.interpolation(collocation.nodes()[k]);
      CHECK(at == Eigen::VectorXd::Unit(stages + 1, static_cast<Eigen::Index>(k)));
    }
    for (const double c : {0.0, 1e-3, 0.3, 0.77, 1.0}) {
      const ExponentialCollocation::Place place = collocation.place(c);
      for (int power = 0; power <= stages; ++power) {
        const Eigen::VectorXd values = powers_at(collocation.nodes(), power);
        CHECK(place.interpolation().dot(values) == Approx(std::pow(c, power)).margin(1e-14));
        const double slope = power == 0 ? 0.0 : power * std::pow(c, power - 1);
        CHECK(place.derivative().dot(values) == Approx(slope).margin(1e-11));
      }
    }
  }
}

TEST_CASE("What follows a polynomial with a relaxation time is found to rounding") {
  for (const int stages : {2, 5, 8}) {
    const ExponentialCollocation collocation(from_start(stages));
    for (const double c : {1e-2, 0.4, 1.0}) {
      const ExponentialCollocation::Place place = collocation.place(c);
      for (const double z : {1e-6, 1e-2, 0.9, 8.0, 59.0, 61.0, 250.0, 1e4, 1e9}) {
        const Eigen::VectorXd weights = place.weights(z);
        const Eigen::VectorXd lag = place.lag(z);
        const double dz = 1e-5 * z;
        const Eigen::VectorXd slope =
            (place.weights(z + dz) - place.weights(z - dz)) / (2.0 * dz) * z;
        for (int power = 0; power <= stages; ++power) {
          INFO(stages << " stages, c " << c << ", z " << z << ", power " << power);
          const Eigen::VectorXd values = powers_at(collocation.nodes(), power);
          const double exact = followed(power, c, z);
          CHECK(weights.dot(values) == Approx(exact).epsilon(1e-11).margin(2e-14));
          CHECK(lag.dot(values) == Approx(std::pow(c, power) - exact).margin(2e-13));
          CHECK(z * place.weight_slopes(z).dot(values) == Approx(slope.dot(values)).margin(2e-9));
        }
      }
    }
  }
}
