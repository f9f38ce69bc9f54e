#include "tpm/organ/bonds/stiffness_blocks.hpp"

namespace tpm::organ {

std::shared_ptr<const BondSystem::PartGraph> moving_graph(const BondSystem& bonds,
                                                          const Constraints& constraints) {
  std::vector<bool> held(bonds.spheres());
  for (std::size_t i = 0; i < held.size(); ++i) {
    held[i] = !constraints.is_free(i) && constraints.projector(i).isZero(0.0);
  }
  return bonds.part_graph(held);
}

StiffnessBlocks::StiffnessBlocks(const BondSystem& bonds, const Constraints& constraints)
    : bonds_(bonds),
      constraints_(constraints),
      graph_(moving_graph(bonds, constraints)),
      matrix_(graph_->pattern) {}

const BlockMatrix& StiffnessBlocks::assemble(const Positions& position,
                                             const ViscousState& viscous_state) {
  matrix_.set_zero();
  for (std::size_t i = 0; i < bonds_.size(); ++i) {
    const Eigen::Matrix3d block = bonds_.stiffness_block(i, position, viscous_state);
    const std::uint32_t a = bonds_.end_a()[i];
    const std::uint32_t b = bonds_.end_b()[i];
    matrix_.diagonal[a] += block;
    matrix_.diagonal[b] += block;
    if (!graph_->place[i]) continue;
    const auto [index, transposed] = *graph_->place[i];
    Eigen::Matrix3d& below = matrix_.below[index];
    if (constraints_.is_free(a) && constraints_.is_free(b)) {
      below -= block;  // symmetric: the same either way round
    } else {
      below -= constraints_.projector(transposed ? b : a) * block *
               constraints_.projector(transposed ? a : b);
    }
  }
  for (std::size_t i = 0; i < constraints_.size(); ++i) {
    if (constraints_.is_free(i)) continue;
    Eigen::Matrix3d& block = matrix_.diagonal[i];
    const double scale = block.trace() > 0.0 ? block.trace() : 1.0;
    block = (constraints_.projector(i) * block * constraints_.projector(i)).eval() +
            scale * (Eigen::Matrix3d::Identity() - constraints_.projector(i));
  }
  return matrix_;
}

}  // namespace tpm::organ
