#pragma once
// Newton's method for the positions of an implicit stage.
#include "tpm/method/method.hpp"
#include "tpm/network/equilibrium.hpp"

namespace tpm {

/// A spring on each sphere that draws it to a place: what inertia is in an implicit stage.
struct SphereAnchors {
  Eigen::VectorXd stiffness;  ///< N/m, one per sphere
  Positions to;
};

/// Balances bonds, loads and anchors on the free spheres, with as few factorisations as it takes:
/// Newton's method with a factor kept while it converges fast, its steps shortened until the potential
/// falls. Of tissue without anchors the
/// stiffness has to be positive definite wherever it is looked at.
class ImplicitBalance {
 public:
  /// @param bonds, freedom, work must live as long as this
  ImplicitBalance(const BondSystem& bonds, const Freedom& freedom, MethodWork& work);

  /// @param position start, with what is imposed in place; the balance if `completed`
  /// @param load on each sphere, N
  /// @param depth_m size of the displacements that accuracy is relative to, m
  [[nodiscard]] MethodEnd find(Positions& position, const BondMemory& memory,
                               const Eigen::Matrix3Xd& load, double depth_m,
                               const SphereAnchors* anchors = nullptr);

  /// Factorises the stiffness at a position, anchors left out.
  [[nodiscard]] MethodEnd factorise(const Positions& position, const BondMemory& memory);
  /// Replaces forces on the spheres by displacements of the free coordinates.
  void displace(Eigen::Matrix3Xd& vectors);

 private:
  [[nodiscard]] bool factorise_matrix(const Positions& position, const BondMemory& memory,
                                      const SphereAnchors* anchors);
  [[nodiscard]] double potential(const Positions& position, const BondMemory& memory,
                                 const Eigen::Matrix3Xd& load, const SphereAnchors* anchors) const;
  /// What rounding and a share of the depth leave of a force, N.
  [[nodiscard]] double tolerance_N(const Positions& position, double depth_m,
                                   const SphereAnchors* anchors) const;

  const BondSystem& bonds_;
  const Freedom& freedom_;
  MethodWork& work_;
  BlockMatrix matrix_;
  BlockLdlt factor_;
  double stiffest_ = 0.0;  ///< sum of stiffnesses at a sphere, N/m
  Eigen::Matrix3Xd force_, step_;
};

}  // namespace tpm
