#pragma once
#include "tpm/organ/bonds/constraints.hpp"

namespace tpm::organ {

/// The stiffness matrix of what is free, for factorisations: P K P + s (1 - P) as
/// Constraints::constrain makes it, without the blocks of spheres that are fixed.
class StiffnessBlocks {
 public:
  /// @param bonds, constraints must live as long as this
  StiffnessBlocks(const BondSystem& bonds, const Constraints& constraints);

  /// The matrix at a position; the one before is overwritten.
  const BlockMatrix& assemble(const Positions& position, const ViscousState& viscous_state);
  [[nodiscard]] const BlockPattern& pattern() const { return graph_->pattern; }

 private:
  const BondSystem& bonds_;
  const Constraints& constraints_;
  std::shared_ptr<const BondSystem::PartGraph> graph_;
  BlockMatrix matrix_;
};

/// The graph of the spheres of a network that can move.
[[nodiscard]] std::shared_ptr<const BondSystem::PartGraph> moving_graph(
    const BondSystem& bonds, const Constraints& constraints);

}  // namespace tpm::organ
