#pragma once
#include <Eigen/Core>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/balance/equilibrium.hpp"

namespace tpm::contact {

/// A network whose contact sphere stands at u while its viscous elongations are those of the
/// equilibrium under the contact displacement w: y_b = l_b there. With
///
///     Psi(u, w) = min over the free spheres of the energy stored in the springs
///
/// a sample holds its value and derivatives. Displacements of the contact are from rest, in the
/// coordinates of the organ.
struct CondensedSample {
  Eigen::Vector3d u_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d w_m = Eigen::Vector3d::Zero();
  double energy_J = 0.0;                             ///< Psi
  Eigen::Vector3d by_u_N = Eigen::Vector3d::Zero();  ///< dPsi/du: what holds the contact there
  Eigen::Vector3d by_w_N = Eigen::Vector3d::Zero();  ///< dPsi/dw
  Eigen::Matrix3d by_uu = Eigen::Matrix3d::Zero();   ///< N/m
  Eigen::Matrix3d by_wu = Eigen::Matrix3d::Zero();   ///< N/m; rows w, columns u
  Eigen::Matrix3Xd position_m;                       ///< of all spheres
  Eigen::Matrix<double, Eigen::Dynamic, 3> moves;    ///< d position (3 per sphere) / du
};

/// Dissipation of the viscous state at a fictitious displacement w, all per relaxation time: with y
/// the viscous elongations of all bonds, J = dy/dw, g the relaxing stiffness of the bonds and L =
/// dl/du at u = w, the part of L that is not in the span of J is P = L - J (J' g J)^-1 J' g L.
struct CondensedMetric {
  Eigen::Vector3d w_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d metric = Eigen::Matrix3d::Zero();         ///< J' g J, N/m
  Eigen::Matrix3d second_metric = Eigen::Matrix3d::Zero();  ///< P' g P, N/m
  Eigen::Matrix3d second_energy = Eigen::Matrix3d::Zero();  ///< of P in the reduced energy, N/m
  /// Response of all positions (3 per sphere) to viscous elongations along P, the contact fixed.
  Eigen::Matrix<double, Eigen::Dynamic, 3> second_moves;
};

/// Finds samples by balancing the network, from place to place.
class CondensedSampler {
 public:
  /// @param bonds, constraints must live as long as this; the contact is fixed by `constraints`
  /// @param stride_m longest way of the contact from one equilibrium to the next
  CondensedSampler(const BondSystem& bonds, Positions rest, const Constraints& constraints,
                   std::size_t contact, double stride_m);

  /// Goes to the equilibrium under another fictitious displacement.
  /// Throws Error(numerical) where the tissue buckles or no equilibrium is found.
  [[nodiscard]] CondensedMetric relax_at(const Eigen::Vector3d& w_m);

  /// With the viscous state of the latest relax_at(), the contact at u: from the latest sample, or
  /// from the equilibrium if that is nearer. Throws as relax_at().
  [[nodiscard]] CondensedSample sample_at(const Eigen::Vector3d& u_m);

  /// Factorisations so far.
  [[nodiscard]] int factorisations() const { return factorisations_; }

 private:
  using Moves = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  /// An equilibrium and how it moves with the contact.
  struct State {
    Eigen::Vector3d contact = Eigen::Vector3d::Zero();
    Positions position;
    Moves moves;
    Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
  };
  void find_moves(State& state, const ViscousState& viscous_state);
  /// Newton's method with the factorisation at the start, found anew where it converges slowly.
  /// False if it does not converge or the tissue is not stable where it was factorised.
  [[nodiscard]] bool balance(Positions& position, const ViscousState& viscous_state);
  void move(State& state, const Eigen::Vector3d& contact, const ViscousState& viscous_state);
  [[nodiscard]] Moves elongation_moves(const State& state) const;
  [[nodiscard]] Eigen::VectorXd elongations(const State& state) const;

  const BondSystem& bonds_;
  Positions rest_;
  Eigen::Index contact_;
  double stride_m_;
  double tolerance_N_ = 0.0;
  Equilibrium equilibrium_;
  Eigen::Matrix3Xd no_load_;
  State relaxed_, latest_;
  ViscousState viscous_state_;
  Moves viscous_moves_;  ///< J
  int factorisations_ = 0;
};

}  // namespace tpm::contact
