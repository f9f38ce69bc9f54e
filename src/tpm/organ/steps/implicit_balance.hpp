#pragma once
// Newton's method for the positions of an implicit stage.
#include <array>

#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/steps/method.hpp"

namespace tpm::organ {

/// A spring on each sphere that draws it to a place: what inertia is in an implicit stage.
struct SphereAnchors {
  Eigen::VectorXd stiffness;  ///< N/m, one per sphere
  Positions to;
};

/// Balances bonds, loads and anchors on the free spheres, with as few factorisations as it takes:
/// Newton's method, its steps shortened until the potential falls. A factor is kept, from balance
/// to balance, while it converges fast; wherever a new one is found the stiffness of tissue without
/// anchors has to be positive definite.
class ImplicitBalance {
 public:
  /// @param bonds, constraints, work must live as long as this
  ImplicitBalance(const BondSystem& bonds, const Constraints& constraints, MethodWork& work);

  /// @param position start, with what is imposed in place; the balance if `completed`
  /// @param load on each sphere, N
  /// @param depth_m size of the displacements that accuracy is relative to, m
  [[nodiscard]] MethodEnd find(Positions& position, const ViscousState& viscous_state,
                               const Eigen::Matrix3Xd& load, double depth_m,
                               const SphereAnchors* anchors = nullptr);

  /// Factorises the stiffness at a position, anchors left out.
  [[nodiscard]] MethodEnd factorise(const Positions& position, const ViscousState& viscous_state);
  /// Replaces forces on the spheres by displacements of the free coordinates.
  void displace(Eigen::Matrix3Xd& vectors);

 private:
  /// A factor for balances in which bonds follow alike and anchors are as stiff.
  struct KeptFactor {
    explicit KeptFactor(const BlockPattern& pattern) : factor(pattern) {}
    BlockLdlt factor;
    RelaxationFactor relaxation_factor;
    double anchored = 0.0;
    long used = 0;  ///< number of the balance that used it last; 0: holds nothing
  };

  [[nodiscard]] bool factorise_matrix(const Positions& position, const ViscousState& viscous_state,
                                      const SphereAnchors* anchors, BlockLdlt& factor);
  /// The factor kept for balances like this one, or the one longest not used.
  [[nodiscard]] KeptFactor& kept_for(const ViscousState& viscous_state,
                                     const SphereAnchors* anchors);
  void displace(Eigen::Matrix3Xd& vectors, const BlockLdlt& factor);
  [[nodiscard]] double potential(const Positions& position, const ViscousState& viscous_state,
                                 const Eigen::Matrix3Xd& load, const SphereAnchors* anchors) const;
  /// Force that rounding and a share of the depth leave, N.
  [[nodiscard]] double tolerance_N(const Positions& position, double depth_m,
                                   const SphereAnchors* anchors) const;

  const BondSystem& bonds_;
  const Constraints& constraints_;
  MethodWork& work_;
  BlockMatrix matrix_;
  BlockLdlt factor_;  ///< of factorise()
  std::array<KeptFactor, 2> kept_;
  long balances_ = 0;
  double stiffest_ = 0.0;  ///< sum of stiffnesses at a sphere, N/m
  Eigen::Matrix3Xd force_, step_;
};

}  // namespace tpm::organ
