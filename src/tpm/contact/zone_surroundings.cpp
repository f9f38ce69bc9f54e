#include "tpm/contact/zone_surroundings.hpp"

namespace tpm::contact {

LinearBonds::LinearBonds(const PushedContact& tissue, const Positions& position, double relaxed,
                         const std::vector<char>& chosen)
    : bonds_(tissue.bonds()) {
  const ViscousState instantaneous = tissue.viscous_state(position, relaxed, 0.0);
  const ViscousState in_the_end = tissue.viscous_state(position, relaxed, 1.0);
  for (std::size_t b = 0; b < bonds_.size(); ++b) {
    if (chosen[b] == 0) continue;
    const Eigen::Matrix3d first = bonds_.stiffness_block(b, position, instantaneous);
    const Eigen::Matrix3d last = bonds_.stiffness_block(b, position, in_the_end);
    linear_.push_back({b, bonds_.end_a()[b], bonds_.end_b()[b], first, first - last});
  }
}

void LinearBonds::add_resistance(const Eigen::Matrix3Xd& displacement, double relaxation_factor,
                                 Eigen::Matrix3Xd& force) const {
  for (const Linear& bond : linear_) {
    const Eigen::Vector3d apart = displacement.col(bond.b) - displacement.col(bond.a);
    const Eigen::Vector3d pull =
        bond.instantaneous * apart - relaxation_factor * (bond.relaxing * apart);
    force.col(bond.b) += pull;
    force.col(bond.a) -= pull;
  }
}

void LinearBonds::add_relaxing(const Eigen::Matrix3Xd& displacement,
                               Eigen::Matrix3Xd& force) const {
  for (const Linear& bond : linear_) {
    const Eigen::Vector3d pull =
        bond.relaxing * (displacement.col(bond.b) - displacement.col(bond.a));
    force.col(bond.b) += pull;
    force.col(bond.a) -= pull;
  }
}

BlockMatrix LinearBonds::matrix(double relaxation_factor) const {
  BlockMatrix matrix(bonds_.pattern());
  for (const Linear& bond : linear_) {
    const Eigen::Matrix3d block = bond.instantaneous - relaxation_factor * bond.relaxing;
    matrix.diagonal[bond.a] += block;
    matrix.diagonal[bond.b] += block;
    matrix.below[bonds_.place(bond.bond).index] -= block;
  }
  return matrix;
}

}  // namespace tpm::contact
