#pragma once
#include <Eigen/Core>

namespace tpm::law {

/// The x >= 0 that minimises |A x - b|, by the active set method of Lawson and Hanson (Solving
/// Least Squares Problems, 1974, chapter 23).
/// @param a at least as many rows as columns
/// Throws Error(numerical) if it does not end within 10 steps for each column.
[[nodiscard]] Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& a,
                                                        const Eigen::VectorXd& b);

}  // namespace tpm::law
