#include "tpm/network/stiffness_blocks.hpp"

namespace tpm {

std::shared_ptr<const BondSystem::PartGraph> moving_graph(const BondSystem& bonds,
                                                          const Freedom& freedom) {
  std::vector<bool> held(bonds.spheres());
  for (std::size_t i = 0; i < held.size(); ++i) {
    held[i] = !freedom.is_free(i) && freedom.projector(i).isZero(0.0);
  }
  return bonds.part_graph(held);
}

StiffnessBlocks::StiffnessBlocks(const BondSystem& bonds, const Freedom& freedom)
    : bonds_(bonds),
      freedom_(freedom),
      graph_(moving_graph(bonds, freedom)),
      matrix_(graph_->pattern) {}

const BlockMatrix& StiffnessBlocks::assemble(const Positions& position, const BondMemory& memory) {
  matrix_.set_zero();
  for (std::size_t i = 0; i < bonds_.size(); ++i) {
    const Eigen::Matrix3d block = bonds_.stiffness_block(i, position, memory);
    const std::uint32_t a = bonds_.end_a()[i];
    const std::uint32_t b = bonds_.end_b()[i];
    matrix_.diagonal[a] += block;
    matrix_.diagonal[b] += block;
    if (!graph_->place[i]) continue;
    const auto [index, transposed] = *graph_->place[i];
    Eigen::Matrix3d& below = matrix_.below[index];
    if (freedom_.is_free(a) && freedom_.is_free(b)) {
      below -= block;  // symmetric: the same either way round
    } else {
      below -=
          freedom_.projector(transposed ? b : a) * block * freedom_.projector(transposed ? a : b);
    }
  }
  for (std::size_t i = 0; i < freedom_.size(); ++i) {
    if (freedom_.is_free(i)) continue;
    Eigen::Matrix3d& block = matrix_.diagonal[i];
    const double scale = block.trace() > 0.0 ? block.trace() : 1.0;
    block = (freedom_.projector(i) * block * freedom_.projector(i)).eval() +
            scale * (Eigen::Matrix3d::Identity() - freedom_.projector(i));
  }
  return matrix_;
}

}  // namespace tpm
