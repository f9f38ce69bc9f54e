#include "tpm/base/dense_algebra.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace tpm::base {

using Eigen::MatrixXd;
using Eigen::VectorXd;

SymmetricModes symmetric_modes(const Eigen::Ref<const MatrixXd>& a) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> modes(a);
  return {modes.eigenvalues(), modes.eigenvectors()};
}

VectorXd ordered_eigenvalues(const Eigen::Ref<const MatrixXd>& a) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(a, Eigen::EigenvaluesOnly).eigenvalues();
}

SymmetricModes symmetric_modes(const Eigen::Ref<const MatrixXd>& a,
                               const Eigen::Ref<const MatrixXd>& b) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> modes(a, b);
  return {modes.eigenvalues(), modes.eigenvectors()};
}

SymmetricModes tridiagonal_modes(const VectorXd& diagonal, const VectorXd& beside) {
  Eigen::SelfAdjointEigenSolver<MatrixXd> modes;
  modes.computeFromTridiagonal(diagonal, beside);
  return {modes.eigenvalues(), modes.eigenvectors()};
}

Eigen::Vector3d symmetric_eigenvalues(const Eigen::Matrix3d& a) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> modes;
  modes.computeDirect(a, Eigen::EigenvaluesOnly);
  return modes.eigenvalues();
}

double spectral_radius(const MatrixXd& a) {
  return Eigen::EigenSolver<MatrixXd>(a, false).eigenvalues().cwiseAbs().maxCoeff();
}

RightSingular right_singular(const MatrixXd& a) {
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.singularValues(), svd.matrixV()};
}

MatrixXd least_squares(const Eigen::Ref<const MatrixXd>& a, const Eigen::Ref<const MatrixXd>& b) {
  return Eigen::ColPivHouseholderQR<MatrixXd>(a).solve(b);
}

std::optional<MatrixXd> unique_least_squares(const Eigen::Ref<const MatrixXd>& a,
                                             const Eigen::Ref<const MatrixXd>& b) {
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
  if (qr.rank() < a.cols()) return std::nullopt;
  return qr.solve(b);
}

MatrixXd shortest_least_squares(const Eigen::Ref<const MatrixXd>& a,
                                const Eigen::Ref<const MatrixXd>& b) {
  return Eigen::CompleteOrthogonalDecomposition<MatrixXd>(a).solve(b);
}

MatrixXd orthonormal_columns(const MatrixXd& a) {
  return Eigen::HouseholderQR<MatrixXd>(a).householderQ() * MatrixXd::Identity(a.rows(), a.cols());
}

MatrixXd solve_square(const Eigen::Ref<const MatrixXd>& a, const Eigen::Ref<const MatrixXd>& b) {
  return Eigen::PartialPivLU<MatrixXd>(a).solve(b);
}

MatrixXd solve_symmetric(const Eigen::Ref<const MatrixXd>& a, const Eigen::Ref<const MatrixXd>& b) {
  return Eigen::LDLT<MatrixXd>(a).solve(b);
}

std::optional<MatrixXd> positive_inverse(const Eigen::Ref<const MatrixXd>& a) {
  const Eigen::LLT<MatrixXd> factor(a);
  if (factor.info() != Eigen::Success) return std::nullopt;
  return factor.solve(MatrixXd::Identity(a.rows(), a.cols()));
}

Eigen::Matrix3d turn_onto(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  constexpr double kOpposite = 1e-9;
  const double cosine = from.dot(to);
  if (cosine < -1.0 + kOpposite) {  // every half turn about an axis across is the smallest
    const Eigen::Vector3d axis = from.unitOrthogonal();
    return 2.0 * axis * axis.transpose() - Eigen::Matrix3d::Identity();
  }
  const Eigen::Vector3d axis = from.cross(to);
  Eigen::Matrix3d cross;
  cross << 0.0, -axis.z(), axis.y(), axis.z(), 0.0, -axis.x(), -axis.y(), axis.x(), 0.0;
  return Eigen::Matrix3d::Identity() + cross + cross * cross / (1.0 + cosine);
}

}  // namespace tpm::base
