#pragma once
#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/linear/block_rows.hpp"

namespace tpm::organ {

/// The stiffness matrix of what is free, by rows, for solvers that iterate: P K P + s (1 - P) as
/// Constraints::constrain makes it, without the blocks between spheres of which one is fixed.
class StiffnessRows {
 public:
  /// @param bonds, constraints must live as long as this
  StiffnessRows(const BondSystem& bonds, const Constraints& constraints);

  /// The matrix at a position; the one before is overwritten.
  const BlockRows<3, 3>& assemble(const Positions& position, const ViscousState& viscous_state);
  [[nodiscard]] const BlockRows<3, 3>& matrix() const { return matrix_; }

 private:
  void constrain();

  const BondSystem& bonds_;
  const Constraints& constraints_;
  BlockRows<3, 3> matrix_;
  std::vector<std::size_t> diagonal_;  ///< where each sphere's block stands
  struct Pair {
    std::size_t ab, ba;
  };
  std::vector<Pair> off_diagonal_;  ///< where each bond's blocks stand; kNone where left out
};

}  // namespace tpm::organ
