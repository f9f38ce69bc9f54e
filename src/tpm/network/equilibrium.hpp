#pragma once
#include "tpm/network/newton_balance.hpp"

namespace tpm {

/// Balances the forces on the free spheres of a network by Newton's method with a factorisation of
/// the stiffness, whose pivots tell whether it is positive definite. For networks whose factor does
/// not fit there is LargeEquilibrium.
class Equilibrium {
 public:
  /// @param bonds, freedom must live as long as this
  Equilibrium(const BondSystem& bonds, const Freedom& freedom);

  /// @param position start, with what is imposed in place; the equilibrium if converged
  /// @param load on each sphere, N
  /// @param tolerance_N of the force left on each sphere
  [[nodiscard]] EquilibriumSearch find(Positions& position, const BondMemory& memory,
                                       const Eigen::Matrix3Xd& load, double tolerance_N);

  /// Force of bonds and loads on every sphere, N: what is left of it on free coordinates is 0 in
  /// equilibrium; on the others it is minus the reaction.
  void forces(const Positions& position, const BondMemory& memory, const Eigen::Matrix3Xd& load,
              Eigen::Matrix3Xd& force) const;

  /// Factorises the stiffness at a position. False if it cannot be; see also is_stable().
  [[nodiscard]] bool factorise(const Positions& position, const BondMemory& memory);
  [[nodiscard]] bool is_stable() const { return factor_.negative_count() == 0; }
  /// Replaces forces on the spheres by the displacements of the free coordinates under them, with
  /// the stiffness of the last factorisation.
  void displace(Eigen::Ref<Eigen::Matrix3Xd> vectors) const;

  [[nodiscard]] const BlockLdlt& factor() const { return factor_; }
  [[nodiscard]] const BondSystem& bonds() const { return bonds_; }
  [[nodiscard]] const Freedom& freedom() const { return freedom_; }

 private:
  const BondSystem& bonds_;
  const Freedom& freedom_;
  BlockMatrix matrix_;
  BlockLdlt factor_;
};

}  // namespace tpm
