#include "tpm/network/equilibrium.hpp"

namespace tpm {

Equilibrium::Equilibrium(const BondSystem& bonds, const Freedom& freedom)
    : bonds_(bonds), freedom_(freedom), matrix_(bonds.pattern()), factor_(bonds.pattern()) {}

void Equilibrium::forces(const Positions& position, const BondMemory& memory,
                         const Eigen::Matrix3Xd& load, Eigen::Matrix3Xd& force) const {
  balance_forces(bonds_, position, memory, load, force);
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

EquilibriumSearch Equilibrium::find(Positions& position, const BondMemory& memory,
                                    const Eigen::Matrix3Xd& load, double tolerance_N) {
  const auto solve = [this](const Positions& at, const BondMemory& with, Eigen::Matrix3Xd& forces) {
    if (!factorise(at, with)) return TangentAnswer::failed;
    if (!is_stable()) return TangentAnswer::not_definite;
    displace(forces);
    return TangentAnswer::solved;
  };
  return newton_balance(bonds_, freedom_, position, memory, load, tolerance_N, solve);
}

}  // namespace tpm
