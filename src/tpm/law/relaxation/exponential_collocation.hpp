#pragma once
#include <Eigen/Core>
#include <vector>

#include "tpm/law/relaxation/lagrange_basis.hpp"

namespace tpm::law {

/// Right-hand Radau nodes of the unit interval: `count` rising numbers, the last of them 1.
/// @param count 1 to 8
[[nodiscard]] std::vector<double> radau_nodes(int count);

/// Exact update of dy/dt = (l - y)/tau over a step h in which l is the polynomial through its
/// values at given nodes of the step: at the fraction c of the step
///
///     y(c) = exp(-z c) y(0) + sum_k weight_k(c) l_k,   z = h / tau
///     weight_k(c) = z * integral_0^c exp(-z (c - s)) L_k(s) ds,   L_k the Lagrange polynomials
class ExponentialCollocation {
 public:
  /// A fraction c of the step, prepared for the weights of many z.
  class Place {
   public:
    /// The weights of all nodes, to rounding.
    /// @param z >= 0
    [[nodiscard]] Eigen::VectorXd weights(double z) const;
    /// The derivatives of the weights by z.
    [[nodiscard]] Eigen::VectorXd weight_slopes(double z) const;
    /// L_k(c) - weight_k: the weights of l(c) - y(c), to rounding also where y follows l closely.
    [[nodiscard]] Eigen::VectorXd lag(double z) const;
    /// L_k(c) of all nodes: what interpolates at c.
    [[nodiscard]] const Eigen::VectorXd& interpolation() const { return here_; }
    /// The derivatives of L_k at c, by the fraction of the step.
    [[nodiscard]] Eigen::VectorXd derivative() const { return -coefficient_.col(1); }
    [[nodiscard]] double fraction() const { return c_; }

   private:
    [[nodiscard]] Eigen::VectorXd asymptotic_powers(double z) const;

    friend class ExponentialCollocation;
    double c_ = 0.0;
    Eigen::VectorXd here_;
    Eigen::VectorXd ago_, part_;   ///< c - s and weights of the quadrature over [0, c]
    Eigen::MatrixXd shape_;        ///< L_k(s), by (node, abscissa)
    Eigen::MatrixXd coefficient_;  ///< L_k(c - a) = sum_m coefficient(k, m) a^m
  };

  /// @param nodes different numbers in [0, 1], at most 10
  explicit ExponentialCollocation(std::vector<double> nodes);

  [[nodiscard]] const std::vector<double>& nodes() const { return basis_.nodes(); }

  /// @param c in [0, 1]
  [[nodiscard]] Place place(double c) const;

  /// The weights of all nodes, to rounding.
  /// @param c in [0, 1]
  /// @param z >= 0
  [[nodiscard]] Eigen::VectorXd weights(double c, double z) const { return place(c).weights(z); }

  /// L_k(c) of all nodes: what interpolates at c.
  [[nodiscard]] Eigen::VectorXd interpolation(double c) const { return basis_.at(c); }

 private:
  LagrangeBasis basis_;
};

}  // namespace tpm::law
