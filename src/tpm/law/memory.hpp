#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "tpm/law/law.hpp"

namespace tpm {

/// The relaxation function of a law at given parameters, as the time stepper uses it:
///
///     G(t) = constant + sum_j stiffness_j exp(-rate_j t) + dashpot delta(t)
///
/// with the derivatives of the coefficients by the few parameters that they depend on.
struct Memory {
  double constant = 0.0;
  double dashpot = 0.0;  ///< N s/m
  Eigen::VectorXd rate_per_s;
  Eigen::VectorXd stiffness;
  std::vector<int> rate_parameter;  ///< parameter that is 1/rate_j, or -1 if the rate is fixed
  std::vector<int> by;              ///< parameters that the coefficients depend on
  Eigen::MatrixXd d_stiffness;      ///< size branches x by.size()
  Eigen::VectorXd d_constant;       ///< size by.size()
  Eigen::VectorXd d_dashpot;

  /// G(0), without the dashpot.
  [[nodiscard]] double instant() const { return constant + stiffness.sum(); }
};

/// Memory of a law with branches. The parameters it refers to are those of the parallel form:
/// k_inf (if solid), k_1.., tau_1...
[[nodiscard]] Memory branch_memory(bool solid, int branches, std::span<const double> parallel);

}  // namespace tpm
