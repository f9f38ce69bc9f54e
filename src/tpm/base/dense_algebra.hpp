#pragma once
#include <Eigen/Core>
#include <optional>

namespace tpm::base {

// Decompositions of small dense matrices, compiled once: Eigen's templates for them cost the
// compiler seconds in every source that uses one (reports/house/report.md). Singular systems are
// answered where a function says so; matrices that are not finite give results that are not.

/// Eigenvalues in ascending order; the columns of `vectors` belong to them.
struct SymmetricModes {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

/// A = V diag(values) V', V orthogonal. @param a symmetric; the lower triangle is read
[[nodiscard]] SymmetricModes symmetric_modes(const Eigen::Ref<const Eigen::MatrixXd>& a);
/// A v = value B v, V' B V = I. @param b symmetric, positive definite
[[nodiscard]] SymmetricModes symmetric_modes(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                             const Eigen::Ref<const Eigen::MatrixXd>& b);
/// Of a symmetric tridiagonal matrix. @param beside size one less than diagonal's
[[nodiscard]] SymmetricModes tridiagonal_modes(const Eigen::VectorXd& diagonal,
                                               const Eigen::VectorXd& beside);
/// Eigenvalues of a symmetric matrix in ascending order, without vectors. The lower triangle is
/// read.
[[nodiscard]] Eigen::VectorXd ordered_eigenvalues(const Eigen::Ref<const Eigen::MatrixXd>& a);
/// Eigenvalues in ascending order, by the closed form for 3 x 3.
[[nodiscard]] Eigen::Vector3d symmetric_eigenvalues(const Eigen::Matrix3d& a);
/// The largest magnitude of an eigenvalue of a square matrix.
[[nodiscard]] double spectral_radius(const Eigen::MatrixXd& a);

/// Singular values in descending order, and the right singular vectors.
struct RightSingular {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] RightSingular right_singular(const Eigen::MatrixXd& a);

/// X of least |A X - B|, by Householder QR with column pivoting.
[[nodiscard]] Eigen::MatrixXd least_squares(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                            const Eigen::Ref<const Eigen::MatrixXd>& b);
/// The same; none if A has numerically dependent columns.
[[nodiscard]] std::optional<Eigen::MatrixXd> unique_least_squares(
    const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b);
/// Of all X of least |A X - B| the shortest, also for an A of deficient rank.
[[nodiscard]] Eigen::MatrixXd shortest_least_squares(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                                     const Eigen::Ref<const Eigen::MatrixXd>& b);
/// Orthonormal columns that span what those of A span; A has at least as many rows as columns.
[[nodiscard]] Eigen::MatrixXd orthonormal_columns(const Eigen::MatrixXd& a);

/// X of A X = B, A square and regular, by LU with partial pivoting.
[[nodiscard]] Eigen::MatrixXd solve_square(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                           const Eigen::Ref<const Eigen::MatrixXd>& b);
/// X of A X = B, A symmetric, by LDL' with pivoting. The lower triangle is read.
[[nodiscard]] Eigen::MatrixXd solve_symmetric(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                              const Eigen::Ref<const Eigen::MatrixXd>& b);
/// Of a symmetric, positive definite matrix, by LL'; none of another. The lower triangle is read.
[[nodiscard]] std::optional<Eigen::MatrixXd> positive_inverse(
    const Eigen::Ref<const Eigen::MatrixXd>& a);

/// The smallest turn that takes one unit vector onto another.
[[nodiscard]] Eigen::Matrix3d turn_onto(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace tpm::base
