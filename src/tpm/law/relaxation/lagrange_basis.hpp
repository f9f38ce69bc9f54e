#pragma once
#include <Eigen/Core>
#include <vector>

namespace tpm::law {

/// The Lagrange polynomials of some nodes: L_k is 1 at node k and 0 at the others.
class LagrangeBasis {
 public:
  /// @param nodes different numbers
  explicit LagrangeBasis(std::vector<double> nodes);

  [[nodiscard]] const std::vector<double>& nodes() const { return nodes_; }
  /// L_k(c) of all nodes; exactly 1 and 0 at a node.
  [[nodiscard]] Eigen::VectorXd at(double c) const;
  /// For each node, the product of its distances from the others, by which L_k is scaled.
  [[nodiscard]] const Eigen::VectorXd& scale() const { return scale_; }

 private:
  [[nodiscard]] Eigen::VectorXd others(double c) const;

  std::vector<double> nodes_;
  Eigen::VectorXd scale_;
};

}  // namespace tpm::law
