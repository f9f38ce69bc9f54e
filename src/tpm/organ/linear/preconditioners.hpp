#pragma once
#include "tpm/organ/linear/conjugate_gradients.hpp"

namespace tpm::organ {

/// The inverse of each diagonal block.
class BlockJacobi final : public Preconditioner {
 public:
  explicit BlockJacobi(const BlockRows<3, 3>& matrix);
  [[nodiscard]] bool definite() const override { return !inverse_.empty(); }
  void apply(const BlockVector<3>& r, BlockVector<3>& z) const override;

 private:
  std::vector<Eigen::Matrix3d> inverse_;
};

/// L D L^T on the pattern of the matrix, with 3x3 pivots (incomplete Cholesky without fill,
/// Meijerink & van der Vorst 1977). Where a pivot is not positive definite, the diagonal is
/// enlarged for the factorisation alone, by 1e-3 and then doubling (Manteuffel 1980).
class IncompleteCholesky final : public Preconditioner {
 public:
  explicit IncompleteCholesky(const BlockRows<3, 3>& matrix);
  [[nodiscard]] bool definite() const override { return !inverse_.empty(); }
  void apply(const BlockVector<3>& r, BlockVector<3>& z) const override;

 private:
  [[nodiscard]] bool factorise(const BlockRows<3, 3>& matrix);

  BlockRows<3, 3> lower_;  ///< L without its diagonal
  std::vector<Eigen::Matrix3d> pivot_, inverse_;
  double shift_ = 0.0;
};

}  // namespace tpm::organ
