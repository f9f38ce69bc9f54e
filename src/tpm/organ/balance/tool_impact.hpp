#pragma once
#include <Eigen/Core>
#include <span>

#include "tpm/organ/bonds/constraints.hpp"

namespace tpm::organ {

/// A sphere and a tool that touch.
struct TouchingPair {
  Eigen::Index sphere = 0, tool = 0;  ///< columns
  Eigen::Vector3d normal;             ///< unit vector from the sphere to the tool
};

/// The impact of tools on spheres, perfectly inelastic: no pair that touches approaches any more
/// afterwards, and none is pulled together. With J the rates at which gaps grow per velocity, the
/// impulses p solve (Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988,
/// with restitution 0)
///
///     v+ = v + M^-1 J' p,    p >= 0,    J v+ >= 0,    p . J v+ = 0,
///
/// so that the kinetic energy falls, by 1/2 m_eff (approach speed)^2 for one pair alone. Momentum
/// is kept but for what is fixed, guided or imposed. Found by successive impulses (Gauss-Seidel).
/// @param constraints what they do not leave free has no velocity to lose: it acts as an infinite
/// mass
/// @param mass_kg of each column, > 0
/// @param velocity of each column, m/s; changed
/// @returns impulse of each pair, N s, >= 0: on the tool along the normal, on the sphere against
/// it.
///          0 for a pair of which nothing is free.
/// Throws Error(numerical) if the impulses do not settle.
[[nodiscard]] Eigen::VectorXd inelastic_impact(std::span<const TouchingPair> pairs,
                                               const Constraints& constraints,
                                               const Eigen::VectorXd& mass_kg,
                                               Eigen::Matrix3Xd& velocity);

}  // namespace tpm::organ
