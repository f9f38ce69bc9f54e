#include "tpm/network/equilibrium.hpp"

#include <cmath>

namespace tpm {
namespace {

constexpr int kMostNewtonSteps = 60;
constexpr int kMostHalvings = 30;

double largest(const Eigen::Matrix3Xd& vectors) {
  return vectors.colwise().norm().maxCoeff();
}

}  // namespace

Equilibrium::Equilibrium(const BondSystem& bonds, const Freedom& freedom)
    : bonds_(bonds), freedom_(freedom), matrix_(bonds.pattern()), factor_(bonds.pattern()) {}

void Equilibrium::forces(const Positions& position, const BondMemory& memory,
                         const Eigen::Matrix3Xd& load, Eigen::Matrix3Xd& force) const {
  force = load;
  bonds_.add_forces(position, memory, force);
}

bool Equilibrium::factorise(const Positions& position, const BondMemory& memory) {
  matrix_.set_zero();
  bonds_.add_stiffness(position, memory, matrix_);
  freedom_.constrain(bonds_, matrix_);
  return factor_.factorise(matrix_);
}

// A Ref is a view: what it shows is changed.
// NOLINTNEXTLINE(performance-unnecessary-value-param)
void Equilibrium::displace(Eigen::Ref<Eigen::Matrix3Xd> vectors) const {
  freedom_.project(vectors);
  factor_.solve(vectors);
  freedom_.project(vectors);
}

double Equilibrium::potential(const Positions& position, const BondMemory& memory,
                              const Eigen::Matrix3Xd& load) const {
  return bonds_.potential_J(position, memory) - position.cwiseProduct(load).sum();
}

EquilibriumSearch Equilibrium::find(Positions& position, const BondMemory& memory,
                                    const Eigen::Matrix3Xd& load, double tolerance_N) {
  EquilibriumSearch search;
  Eigen::Matrix3Xd force;
  Eigen::Matrix3Xd step;
  double energy = potential(position, memory, load);
  for (;;) {
    forces(position, memory, load, force);
    freedom_.project(force);
    search.residual_N = largest(force);
    if (!std::isfinite(search.residual_N)) return search;
    search.converged = search.residual_N <= tolerance_N;
    if (search.converged && search.factorisations > 0) return search;
    if (search.iterations == kMostNewtonSteps) return search;
    ++search.factorisations;
    if (!factorise(position, memory)) return search;
    search.stable = is_stable();
    if (search.converged || !search.stable) return search;
    ++search.iterations;
    step = force;
    displace(step);
    const double slope = -force.cwiseProduct(step).sum();
    // What rounding leaves of the potential is not to stop the last steps.
    const double grain = 1e-14 * std::abs(energy);
    double length = 1.0;
    for (int halvings = 0;; ++halvings, length *= 0.5) {
      if (halvings == kMostHalvings) return search;
      const Positions next = position + length * step;
      const double there = potential(next, memory, load);
      if (!(there <= energy + 1e-4 * length * slope + grain)) continue;
      position = next;
      energy = there;
      break;
    }
  }
}

}  // namespace tpm
