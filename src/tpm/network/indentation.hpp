#pragma once
#include <functional>
#include <span>

#include "tpm/network/newton_balance.hpp"

namespace tpm::organ {

/// A patch of spheres glued to a flat punch and pushed into a tissue at rest.
struct PatchIndentation {
  std::vector<std::size_t> patch;                        ///< spheres, from 0
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector into the tissue
  double depth_m = 0.002;
  int strides = 1;                 ///< equal parts of the depth, >= 1
  double relaxation_factor = 0.0;  ///< 0: instantaneous, 1: equilibrium; see ViscousState
  double tolerance_N = 1e-9;       ///< of the force left on each free sphere
};

struct IndentationResult {
  double force_N = 0.0;      ///< of the punch on the tissue, along the direction
  double imbalance_N = 0.0;  ///< of punch and anchors, all forces of bonds summed up
  int newton_steps = 0;
  double residual_N = 0.0;
  Positions position;
};

/// One way to find equilibria: what Equilibrium and LargeEquilibrium share.
struct EquilibriumFinder {
  /// Replaces forces by displacements with the stiffness at a position.
  TangentSolve solve;
  std::function<EquilibriumSearch(Positions&, const ViscousState&, const Eigen::Matrix3Xd& load,
                                  double tolerance_N)>
      find;
};

class Equilibrium;
class LargeEquilibrium;
/// @param solver must live as long as what is returned
[[nodiscard]] EquilibriumFinder finder_of(Equilibrium& solver);
[[nodiscard]] EquilibriumFinder finder_of(LargeEquilibrium& solver);

/// The spheres of the outer layer within `radius_m` of a point.
[[nodiscard]] std::vector<std::size_t> surface_patch(const Organ& organ,
                                                     const Eigen::Vector3d& point, double radius_m);

/// The spheres whose place along `direction` is within `thickness_m` of the farthest: the far side,
/// for a punch that moves along it.
[[nodiscard]] std::vector<std::size_t> far_side(const Organ& organ,
                                                const Eigen::Vector3d& direction,
                                                double thickness_m);

/// Force of a glued punch per depth at rest, to first order, N/m: u^T K u of the displacements
/// under a motion of 1 of the patch, so that an error of u counts by its square.
/// @param patch spheres that are fixed in the constraints of the solver
/// @param relaxation_factor see ViscousState
/// @param tolerance of LargeEquilibrium::solve
/// Throws Error(numerical) if the stiffness is not positive definite or the solution fails.
[[nodiscard]] double punch_stiffness(LargeEquilibrium& solver, const Positions& rest,
                                     std::span<const std::size_t> patch,
                                     const Eigen::Vector3d& direction, double relaxation_factor,
                                     double tolerance);

/// Pushes the patch to its depth, stride by stride: in each the free spheres follow to first order,
/// then they find their balance.
/// @param constraints in which the patch is fixed already
/// Throws Error(bad_input) for an empty patch or numbers out of range, Error(numerical) where the
/// stiffness is not positive definite, at the balance or on the way to it, or no balance is found;
/// the message tells the depth.
[[nodiscard]] IndentationResult indent(const BondSystem& bonds, const Constraints& constraints,
                                       const Positions& rest, const PatchIndentation& indentation,
                                       const EquilibriumFinder& finder);

}  // namespace tpm::organ
