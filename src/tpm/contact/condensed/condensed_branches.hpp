#pragma once
#include <Eigen/Core>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/contact/condensed/condensed_fit.hpp"

namespace tpm::contact {

/// One of the branches by which all relaxing bonds of a condensed network relax.
struct CondensedBranch {
  double share = 1.0;              ///< gamma of the relaxing stiffness; all add up to 1
  double relaxation_time_s = 0.0;  ///< > 0
};

/// Modes of the linear motion of a condensed viscous state (w, q) with the contact at rest, one
/// relaxation time: d xi_k/dt = -rate_k xi_k/tau with xi = left (w, q), (w, q) = right xi.
struct CondensedModes {
  CondensedVector rate;
  Eigen::Matrix<double, 6, 6> left, right;

  /// A of d(w, q)/dt = -A (w, q)/tau.
  [[nodiscard]] Eigen::Matrix<double, 6, 6> rates() const {
    return right * rate.asDiagonal() * left;
  }
};
[[nodiscard]] CondensedModes condensed_modes(const CondensedFit& fit);

/// The viscous state of a condensed network with several branches. The mean viscous elongation of
/// the bonds is y(w) + P q, w = sum gamma_j w_j and q alike, so that force and field are those of
/// one branch. The viscous state of branch j differs from it by C a_j along y(w) and by p_j along
/// P:
///
///     tau_j d(w_j)/dt = v_w(u, w, q) - C a_j,      tau_j dq_j/dt = v_q(u, w, q) - p_j
///
/// with v the motion of one branch of relaxation time 1 and C C' = M^-1, M = J' g J the metric of
/// the viscous state at w (Cholesky). The stored energy is
///
///     S = Psi(u, w) - z' N q + q' G q/2 + sum gamma_j (|a_j|^2 + p_j' N p_j)/2
///
/// a_j keeps its value while w, and with it C, moves: so dS/dt = work - sum gamma_j |C^-1 (v_w -
/// C a_j)|^2/tau_j - (terms of q), without derivatives of M (docs/theory.md).
///
/// A step is linear in the difference from the motion's linear part, which is solved exactly for
/// all branches together. No call allocates but the constructor.
class CondensedBranches {
 public:
  /// @param fit must live as long as this
  CondensedBranches(const CondensedFit& fit, const std::vector<CondensedBranch>& branches,
                    double period_s);

  void reset() noexcept;
  /// Step of state.u -> to (m, in the axes of the contact), as step_condensed() for one branch.
  void step(CondensedState& state, const Eigen::Vector3d& to) noexcept;
  /// Stored in the differences of the branches, J.
  [[nodiscard]] double spread_J() const noexcept { return spread_J_; }
  /// Where the contact is, of its way in a step, while the viscous state relaxes, 0.5 to 1.
  [[nodiscard]] double relaxation_point() const noexcept { return relaxation_point_; }
  /// Root of the mean square of q over the branches, m.
  [[nodiscard]] Eigen::Vector3d second_m(const CondensedState& state) const noexcept;

 private:
  void set_frame(const CondensedMatricesAt& matrices) noexcept;

  const CondensedTables* tables_;
  CondensedModes modes_;
  Eigen::Matrix3d second_metric_;  ///< N: mean, N/m
  double relaxation_point_ = 1.0;
  // Of each branch, of modes: a column.
  using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic>;
  Eigen::VectorXd share_;
  Columns follow_;  ///< h phi1(h B) D^-1, those that branch j follows side by side
  Columns drift_;   ///< per way of the contact
  Columns later_;   ///< h phi2(h B) D^-1 1
  Columns pending_;

  Eigen::Matrix3d frame_ = Eigen::Matrix3d::Zero();  ///< C
  Columns spread_;                                   ///< a_j, p_j of each branch
  double spread_J_ = 0.0;
  Columns lacks_, moved_, next_;  ///< of the step
};

}  // namespace tpm::contact
