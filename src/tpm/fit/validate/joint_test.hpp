#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace tpm::fit {

/// Hotelling's T^2 over the quantities that are independent.
struct JointTest {
  int rank = 0;
  double t_squared = 0.0, f = 0.0, p_value = 1.0;
  double degrees = 0.0;                ///< of the denominator
  std::vector<std::string> dependent;  ///< quantities that follow from the others
  std::vector<std::string> unknown;    ///< left out: a part of their uncertainty is not known
};

/// Fills T^2 and F from the errors of quantities and their covariance. A quantity is independent
/// if the others before it leave 1e-4 of its variance; the test takes those.
/// @param follows whether a quantity is known to follow from the others
/// @param degrees of freedom of the covariance, the fewest of any quantity
/// @return places of the quantities that were left out
[[nodiscard]] std::vector<std::size_t> test_together(JointTest& joint, const Eigen::VectorXd& error,
                                                     const Eigen::MatrixXd& covariance,
                                                     const std::vector<bool>& follows,
                                                     double degrees);

}  // namespace tpm::fit
