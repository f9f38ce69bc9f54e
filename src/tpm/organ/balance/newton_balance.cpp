#include "tpm/organ/balance/newton_balance.hpp"

#include <cmath>

namespace tpm::organ {
namespace {

constexpr int kMostNewtonSteps = 60;
constexpr int kMostHalvings = 30;
constexpr double kArmijo = 1e-4;  // of the decrease that the slope promises
/// Of a potential: small elongations are differences of lengths, with few digits.
constexpr double kRounding = 1e-9;

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
    double length = 1.0;
    for (int halvings = 0;; ++halvings, length *= 0.5) {
      if (halvings == kMostHalvings) return search;
      const Positions next = position + length * step;
      const double there = potential(bonds, next, viscous_state, load);
      if (!(there <= energy + kArmijo * length * slope)) {
        // Near the balance the potential falls by less than its rounding: the slope decides.
        if (!(there <= energy + kRounding * std::abs(energy))) continue;
        balance_forces(bonds, next, viscous_state, load, force);
        constraints.project(force);
        const double slope_there = -force.cwiseProduct(step).sum();
        if (!(slope_there <= (2.0 * kArmijo - 1.0) * slope)) continue;
      }
      position = next;
      energy = there;
      break;
    }
  }
}

}  // namespace tpm::organ
