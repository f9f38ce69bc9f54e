#pragma once
// Position-based dynamics with compliance on the bonds of a network.
#include <vector>

#include "tpm/organ/bonds/bond_system.hpp"
#include "tpm/organ/bonds/constraints.hpp"

namespace tpm::organ {

/// Bonds with viscous state as compliant constraints (Macklin, Mueller, Chentanez: XPBD, 2016). The
/// viscous elongation at the end of a step is y = offset + relaxation_factor V(l), so that it pulls
/// with N = (k - g) u(l) + g ((1 - relaxation_factor) V(l) - offset): where it is linear, a
/// constraint on l of compliance 1/(k - relaxation_factor g) about a rest elongation, and else a
/// step of Newton's method towards it. The multiplier is N itself here, which leaves bonds without
/// stiffness in.
class BondProjection {
 public:
  /// @param bonds, constraints must live as long as this; contacts with tools are not projected
  BondProjection(const BondSystem& bonds, const Constraints& constraints);

  /// Multipliers start at 0.
  void forget() { tension_.setZero(); }
  /// Multipliers start at what the bonds pull with.
  void store_tensions(const Positions& position, const ViscousState& viscous_state) {
    bonds_.tensions(position, viscous_state, tension_);
  }

  /// One sweep over the bonds in their order (Gauss-Seidel).
  /// @param compliance_m_per_N how far each sphere goes under a force
  void sweep(Positions& position, const ViscousState& viscous_state,
             const Eigen::VectorXd& compliance_m_per_N);

 private:
  const BondSystem& bonds_;
  const Constraints& constraints_;
  Eigen::VectorXd tension_;  ///< N
};

}  // namespace tpm::organ
