#include "tpm/organ/balance/newton_balance.hpp"

#include <cmath>

namespace tpm::organ {
namespace {

constexpr int kMostNewtonSteps = 60;
constexpr int kMostHalvings = 30;

double potential(const BondSystem& bonds, const Positions& position,
                 const ViscousState& viscous_state, const Eigen::Matrix3Xd& load) {
  return bonds.potential_J(position, viscous_state) - position.cwiseProduct(load).sum();
}

}  // namespace

void balance_forces(const BondSystem& bonds, const Positions& position,
                    const ViscousState& viscous_state, const Eigen::Matrix3Xd& load,
                    Eigen::Matrix3Xd& force) {
  force = load;
  bonds.add_forces(position, viscous_state, force);
}

EquilibriumSearch newton_balance(const BondSystem& bonds, const Constraints& constraints,
                                 Positions& position, const ViscousState& viscous_state,
                                 const Eigen::Matrix3Xd& load, double tolerance_N,
                                 const TangentSolve& solve) {
  EquilibriumSearch search;
  Eigen::Matrix3Xd force;
  Eigen::Matrix3Xd step;
  double energy = potential(bonds, position, viscous_state, load);
  for (;;) {
    balance_forces(bonds, position, viscous_state, load, force);
    constraints.project(force);
    search.residual_N = force.colwise().norm().maxCoeff();
    if (!std::isfinite(search.residual_N)) return search;
    search.converged = search.residual_N <= tolerance_N;
    if (search.converged && search.factorisations > 0) return search;
    if (search.iterations == kMostNewtonSteps) return search;
    ++search.factorisations;
    step = force;
    const TangentAnswer answer = solve(position, viscous_state, step);
    if (answer == TangentAnswer::failed) return search;
    search.stable = answer == TangentAnswer::solved;
    if (search.converged || !search.stable) return search;
    ++search.iterations;
    const double slope = -force.cwiseProduct(step).sum();
    // Rounding of the potential must not stop the last steps.
    const double rounding = 1e-14 * std::abs(energy);
    double length = 1.0;
    for (int halvings = 0;; ++halvings, length *= 0.5) {
      if (halvings == kMostHalvings) return search;
      const Positions next = position + length * step;
      const double there = potential(bonds, next, viscous_state, load);
      if (!(there <= energy + 1e-4 * length * slope + rounding)) continue;
      position = next;
      energy = there;
      break;
    }
  }
}

}  // namespace tpm::organ
