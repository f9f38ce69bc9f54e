#pragma once
#include <Eigen/Core>
#include <array>

namespace tpm::contact {

/// Of w, then of q: a viscous state of a condensed model in the axes of the contact, m.
using CondensedVector = Eigen::Matrix<double, 6, 1>;

/// Coefficient of p^i s^n in the potential, a polynomial of the scaled tangential coordinates
/// t:
///
///     constant + linear' t + t' square t/2 + sum over k of t_k t' cube_k t/6
struct CondensedColumn {
  double constant = 0.0;
  Eigen::Vector4d linear = Eigen::Vector4d::Zero();
  Eigen::Matrix4d square = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 16> cube = Eigen::Matrix<double, 4, 16>::Zero();  ///< four cube_k
};

/// The polynomials of a condensed model as its step reads them. p and s are the scaled depths of u
/// and w, t the scaled tangential coordinates (u, u, w, w).
struct CondensedTables {
  static constexpr int kDepths = 8;  ///< powers of a depth
  static constexpr int kMatrixTerms = 14;

  /// By i, then n; i + n is at most kCondensedDegrees of the power of t.
  std::array<std::array<CondensedColumn, kDepths>, kDepths> columns;
  /// Coefficients of CondensedMatrices.
  Eigen::Matrix<double, 18, kMatrixTerms> matrices =
      Eigen::Matrix<double, 18, kMatrixTerms>::Zero();
  Eigen::Matrix3d second_rate = Eigen::Matrix3d::Zero();  ///< H: dq/dt = -H q/tau
  double middle_depth_m = 0.0, per_half_depth = 0.0, per_tangential = 0.0;
};

/// Matrices that move the viscous state, at w.
struct CondensedMatricesAt {
  Eigen::Matrix3d mobility;  ///< M^-1, m/N
  Eigen::Matrix3d coupling;  ///< N, N/m
  Eigen::Matrix3d second;    ///< G, N/m
};
[[nodiscard]] CondensedMatricesAt condensed_matrices_at(const CondensedTables& tables,
                                                        const Eigen::Vector3d& w) noexcept;

/// Effect of a viscous state with the contact at u.
struct CondensedPull {
  CondensedVector velocity;  ///< of the viscous state per relaxation time, m
  Eigen::Vector3d force_N;   ///< on what is in contact: minus the gradient of the energy by u
  double energy_J = 0.0;     ///< stored, with all branches alike
};
/// @param matrices condensed_matrices_at() w
[[nodiscard]] CondensedPull condensed_pull(const CondensedTables& tables, const Eigen::Vector3d& u,
                                           const CondensedVector& viscous,
                                           const CondensedMatricesAt& matrices) noexcept;

/// The state of a condensed model between steps, and its answer; in the axes of the contact.
struct CondensedState {
  /// At rest.
  explicit CondensedState(const CondensedTables& tables) noexcept;

  CondensedVector viscous = CondensedVector::Zero();
  CondensedMatricesAt matrices;                       ///< at w
  CondensedVector pending = CondensedVector::Zero();  ///< to be added to the viscous state, m
  Eigen::Vector3d u = Eigen::Vector3d::Zero();        ///< m
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< on what is in contact
  bool kept = false;  ///< the latest step did not change the viscous state
};

/// Coefficients of a step that depend on period and relaxation time.
struct CondensedRates {
  using Matrix = Eigen::Matrix<double, 6, 6>;
  Matrix first = Matrix::Zero();                                            ///< x phi1(x A)
  Matrix second = Matrix::Zero();                                           ///< x phi2(x A)
  Matrix rate = Matrix::Zero();                                             ///< A
  Eigen::Matrix<double, 6, 3> drift = Eigen::Matrix<double, 6, 3>::Zero();  ///< C
  double relaxation_point = 1.0;
};

/// One step to state.u -> to (m, in the axes of the contact), docs/theory.md.
void step_condensed(const CondensedTables& tables, const CondensedRates& rates,
                    CondensedState& state, const Eigen::Vector3d& to) noexcept;

}  // namespace tpm::contact
