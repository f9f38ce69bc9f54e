#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tpm/organ/linear/aligned_floats.hpp"
#include "tpm/organ/linear/elimination_fronts.hpp"
#include "tpm/organ/linear/panel_kernels.hpp"

namespace tpm::organ {

/// A positive definite matrix of 3x3 blocks, factorised in double precision (multifrontal; Duff and
/// Reid, ACM TOMS 1983) and kept for many solutions at little cost, to correct iterates whose
/// residual is known better: of every front the inverse of its pivot and what it passes on, as
/// dense blocks in 8 binary digits a number, since a solution is bound by reading them.
class FrontalFactor {
 public:
  using Edge = EliminationFronts::Edge;

  /// @param portable without vector instructions beyond those of every processor
  explicit FrontalFactor(std::shared_ptr<const EliminationFronts> fronts, bool portable = false);

  /// 3x3 blocks that a solution reads: pivots whole, once; what they reach, twice.
  [[nodiscard]] static std::size_t blocks_read(const EliminationFronts& fronts);

  /// False if the matrix is not positive definite; the factor is then of no use.
  /// @param diagonal of each node, in the order of the nodes
  /// @param edges of the graph that the fronts are of
  /// @param across block (a, b) of each edge; those of one pair are added
  [[nodiscard]] bool factorise(std::span<const Eigen::Matrix3d> diagonal,
                               std::span<const Edge> edges,
                               std::span<const Eigen::Matrix3d> across);

  /// Replaces the right-hand side by the solution, to about a hundredth of it for matrices that are
  /// not near singular. Allocates nothing.
  /// @param x four floats per node, the fourth of no meaning, in the order of elimination; aligned
  ///          to 16 bytes
  void solve(float* x) noexcept;

 private:
  struct Place {
    std::uint32_t first, own;     ///< nodes
    std::uint32_t rows, count;    ///< of all rows
    std::size_t inverse, passed;  ///< of words_
  };
  [[nodiscard]] PackedPanel inverse(const Place& front) const;
  [[nodiscard]] PackedPanel passed(const Place& front) const;

  std::shared_ptr<const EliminationFronts> fronts_;
  const PanelKernels& kernels_;
  std::vector<Place> front_;
  AlignedWords words_;
  AlignedFloats own_, reached_, sum_;  ///< of one front, three floats per node
};

}  // namespace tpm::organ
