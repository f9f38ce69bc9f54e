#pragma once
// A glued punch pushed into a tissue, for either equilibrium solver: in tests and measurements.
#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <span>

#include "tpm/base/text.hpp"
#include "tpm/organ/balance/equilibrium.hpp"
#include "tpm/organ/balance/large_equilibrium.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
using namespace organ;

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

/// @param solver must live as long as what is returned
inline EquilibriumFinder finder_of(Equilibrium& solver) {
  const auto solve = [&solver](const Positions& position, const ViscousState& viscous_state,
                               Eigen::Matrix3Xd& forces) {
    if (!solver.factorise(position, viscous_state)) return TangentAnswer::failed;
    if (!solver.is_stable()) return TangentAnswer::not_definite;
    solver.displace(forces);
    return TangentAnswer::solved;
  };
  return {solve, [&solver](Positions& position, const ViscousState& viscous_state,
                           const Eigen::Matrix3Xd& load, double tolerance_N) {
            return solver.find(position, viscous_state, load, tolerance_N);
          }};
}

inline EquilibriumFinder finder_of(LargeEquilibrium& solver) {
  constexpr double kFollowTolerance = 1e-2;  // of the first-order answer to a stride
  const auto solve = [&solver](const Positions& position, const ViscousState& viscous_state,
                               Eigen::Matrix3Xd& forces) {
    return solver.solve(position, viscous_state, forces, kFollowTolerance);
  };
  return {solve, [&solver](Positions& position, const ViscousState& viscous_state,
                           const Eigen::Matrix3Xd& load, double tolerance_N) {
            return solver.find(position, viscous_state, load, tolerance_N);
          }};
}

/// The spheres of the outer layer within `radius_m` of a point.
inline std::vector<std::size_t> surface_patch(const Organ& organ, const Eigen::Vector3d& point,
                                              double radius_m) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] != 0) continue;
    const auto column = static_cast<Eigen::Index>(i);
    if ((organ.position.col(column) - point).norm() <= radius_m) found.push_back(i);
  }
  return found;
}

/// The spheres whose place along `direction` is within `thickness_m` of the farthest: the far side,
/// for a punch that moves along it.
inline std::vector<std::size_t> far_side(const Organ& organ, const Eigen::Vector3d& direction,
                                         double thickness_m) {
  const Eigen::VectorXd along = organ.position.transpose() * direction;
  const double farthest = along.maxCoeff();
  std::vector<std::size_t> found;
  for (Eigen::Index i = 0; i < along.size(); ++i) {
    if (along[i] >= farthest - thickness_m) found.push_back(static_cast<std::size_t>(i));
  }
  return found;
}

/// Met before the balance is reached, it may be the stride's fault.
inline constexpr std::string_view kNotDefinite =
    "the stiffness is not positive definite (the tissue buckles, or strides are too long)";

inline void require_valid(const PatchIndentation& indentation, const Constraints& constraints) {
  const auto refuse = [](const std::string& got, std::string_view expected) {
    throw bad_input("indentation", got, expected);
  };
  if (indentation.patch.empty()) refuse("a patch without spheres", "a wider patch");
  for (const std::size_t sphere : indentation.patch) {
    if (sphere >= constraints.size() || !constraints.projector(sphere).isZero(0.0)) {
      refuse(fmt::format("sphere {} of the patch", sphere + 1), "a sphere that is fixed by it");
    }
  }
  if (!std::isfinite(indentation.depth_m)) {
    refuse(fmt::format("a depth of {} m", shortest(indentation.depth_m)), "a finite length");
  }
  if (indentation.strides < 1) refuse(fmt::format("{} strides", indentation.strides), "1 or more");
  if (!(indentation.tolerance_N > 0.0)) {
    refuse(fmt::format("a tolerance of {} N", shortest(indentation.tolerance_N)), "above 0");
  }
}

inline ViscousState at_rest(const BondSystem& bonds, double relaxation_factor) {
  return {Eigen::VectorXd::Zero(static_cast<Eigen::Index>(bonds.size())), relaxation_factor};
}

[[noreturn]] inline void give_up(double depth_m, std::string_view why) {
  throw Error(ExitCode::numerical, "indentation",
              fmt::format("{} at a depth of {:.4g} mm", why, depth_m * 1e3));
}

/// The free spheres follow a motion of the patch to first order.
inline void follow(const BondSystem& bonds, const Constraints& constraints,
                   const ViscousState& viscous_state, const Eigen::Matrix3Xd& moved,
                   const EquilibriumFinder& finder, double depth_m, Positions& position) {
  Eigen::Matrix3Xd left = Eigen::Matrix3Xd::Zero(3, moved.cols());
  bonds.add_stiffness_times(position, viscous_state, moved, left);
  left = -left;
  constraints.project(left);
  const TangentAnswer answer = finder.solve(position, viscous_state, left);
  if (answer == TangentAnswer::not_definite) give_up(depth_m, kNotDefinite);
  if (answer == TangentAnswer::failed) give_up(depth_m, "no solution with the stiffness");
  position += moved + left;
}

/// Force of a glued punch per depth at rest, to first order, N/m: u^T K u of the displacements
/// under a motion of 1 of the patch, so that an error of u counts by its square.
/// @param patch spheres that are fixed in the constraints of the solver
/// @param relaxation_factor see ViscousState
/// @param tolerance of LargeEquilibrium::solve
/// Throws Error(numerical) if the stiffness is not positive definite or the solution fails.
inline double punch_stiffness(LargeEquilibrium& solver, const Positions& rest,
                              std::span<const std::size_t> patch, const Eigen::Vector3d& direction,
                              double relaxation_factor, double tolerance) {
  const ViscousState viscous_state = at_rest(solver.bonds(), relaxation_factor);
  Eigen::Matrix3Xd moved = Eigen::Matrix3Xd::Zero(3, rest.cols());
  for (const std::size_t sphere : patch) moved.col(static_cast<Eigen::Index>(sphere)) = direction;
  const EquilibriumFinder finder{
      [&](const Positions& position, const ViscousState& with, Eigen::Matrix3Xd& forces) {
        return solver.solve(position, with, forces, tolerance);
      },
      {}};
  Positions after = rest;
  follow(solver.bonds(), solver.constraints(), viscous_state, moved, finder, 0.0, after);
  const Eigen::Matrix3Xd displacement = after - rest;
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, rest.cols());
  solver.bonds().add_stiffness_times(rest, viscous_state, displacement, force);
  return displacement.cwiseProduct(force).sum();
}

/// Pushes the patch to its depth, stride by stride: in each the free spheres follow to first order,
/// then they find their balance.
/// @param constraints in which the patch is fixed already
/// Throws Error(bad_input) for an empty patch or numbers out of range, Error(numerical) where the
/// stiffness is not positive definite, at the balance or on the way to it, or no balance is found;
/// the message tells the depth.
inline IndentationResult indent(const BondSystem& bonds, const Constraints& constraints,
                                const Positions& rest, const PatchIndentation& indentation,
                                const EquilibriumFinder& finder) {
  require_valid(indentation, constraints);
  const ViscousState viscous_state = at_rest(bonds, indentation.relaxation_factor);
  const double stride = indentation.depth_m / indentation.strides;
  const Eigen::Matrix3Xd no_load = Eigen::Matrix3Xd::Zero(3, rest.cols());
  Eigen::Matrix3Xd moved = no_load;
  for (const std::size_t sphere : indentation.patch) {
    moved.col(static_cast<Eigen::Index>(sphere)) = stride * indentation.direction;
  }
  IndentationResult result;
  result.position = rest;
  for (int i = 1; i <= indentation.strides; ++i) {
    const double depth = stride * i;
    follow(bonds, constraints, viscous_state, moved, finder, depth, result.position);
    const EquilibriumSearch search =
        finder.find(result.position, viscous_state, no_load, indentation.tolerance_N);
    if (!search.stable) give_up(depth, kNotDefinite);
    if (!search.converged) give_up(depth, "the forces do not come to balance");
    result.newton_steps += search.iterations;
    result.residual_N = search.residual_N;
  }
  Eigen::Matrix3Xd force;
  balance_forces(bonds, result.position, viscous_state, no_load, force);
  for (const std::size_t sphere : indentation.patch) {
    result.force_N -= indentation.direction.dot(force.col(static_cast<Eigen::Index>(sphere)));
  }
  result.imbalance_N = force.rowwise().sum().norm();
  return result;
}

}  // namespace tpm::organ
