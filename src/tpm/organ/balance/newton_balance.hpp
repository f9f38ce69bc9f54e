#pragma once
#include <functional>

#include "tpm/organ/bonds/bond_system.hpp"
#include "tpm/organ/bonds/constraints.hpp"

namespace tpm::organ {

/// Where an equilibrium was looked for, and what came of it.
struct EquilibriumSearch {
  bool converged = false;
  /// No negative stiffness of what is free was met; see the solver for what it looked at.
  bool stable = true;
  int iterations = 0;  ///< Newton steps
  int factorisations = 0;
  double residual_N = 0.0;  ///< largest force left on a free sphere
};

/// Outcome of a solution with the stiffness matrix.
enum class TangentAnswer { solved, not_definite, failed };

/// Replaces forces on the free spheres by displacements, with the stiffness at a position.
/// @param forces left on the free spheres, N
using TangentSolve = std::function<TangentAnswer(
    const Positions& position, const ViscousState& viscous_state, Eigen::Matrix3Xd& forces)>;

/// Force of bonds and loads on every sphere, N.
void balance_forces(const BondSystem& bonds, const Positions& position,
                    const ViscousState& viscous_state, const Eigen::Matrix3Xd& load,
                    Eigen::Matrix3Xd& force);

/// Newton's method for the balance of the free spheres, its steps shortened until the potential of
/// bonds and loads falls. It ends at the first stiffness that is not positive definite, and looks
/// at one at least.
/// @param position start, with what is imposed in place; the equilibrium if converged
/// @param tolerance_N of the force left on each sphere
[[nodiscard]] EquilibriumSearch newton_balance(const BondSystem& bonds,
                                               const Constraints& constraints, Positions& position,
                                               const ViscousState& viscous_state,
                                               const Eigen::Matrix3Xd& load, double tolerance_N,
                                               const TangentSolve& solve);

}  // namespace tpm::organ
