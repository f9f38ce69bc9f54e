#pragma once
#include <Eigen/Cholesky>
#include <deque>
#include <span>

#include "tpm/organ/linear/conjugate_gradients.hpp"

namespace tpm::organ {

/// The six rigid motions at each node, restricted to what the node may do: N x 6 blocks.
template <int N>
using RigidModes = std::vector<Eigen::Matrix<double, N, 6>>;

/// One level of the hierarchy.
template <int N>
struct GridLevel {
  std::vector<Eigen::Matrix<double, N, N>> inverse;  ///< of the diagonal blocks
  BlockRows<N, 6> prolongation;                      ///< from the next coarser level
  // Room for a cycle.
  mutable BlockVector<N> residual, correction;
  mutable BlockVector<6> coarse_right, coarse_solution;
};

/// One V-cycle of smoothed aggregation multigrid (Vanek, Mandel & Brezina, Computing 56, 1996):
/// nodes are gathered with their neighbours into aggregates, each of which becomes a node with six
/// numbers, one per rigid motion; the prolongation is smoothed by a damped block Jacobi step; a
/// level is smoothed by a forward block Gauss-Seidel sweep before and a backward one after the
/// coarser level's correction. The coarsest level is solved directly.
///
/// Every level of a positive definite matrix is one, so a pivot that is not tells about the matrix.
class Multigrid final : public Preconditioner {
 public:
  /// @param matrix must live as long as this
  /// @param modes of every node; zero where a node is fixed
  Multigrid(const BlockRows<3, 3>& matrix, const RigidModes<3>& modes);

  /// Keeps all levels below the finest, whose sweeps follow the matrix as it is now: with z = M^-1
  /// r for such a sweep and C for the correction from below, the cycle is M^-T D M^-1 + (1 - M^-T
  /// A) C (1 - A M^-1), positive definite with the diagonal blocks D whatever positive definite
  /// matrix C was made of.
  [[nodiscard]] bool refresh() override;
  [[nodiscard]] bool definite() const override { return definite_; }
  void apply(const BlockVector<3>& r, BlockVector<3>& z) const override;

 private:
  template <int N>
  [[nodiscard]] const BlockRows<N, N>& matrix_of(std::size_t level) const;
  template <int N>
  void cycle(std::size_t level, const GridLevel<N>& grid, const BlockVector<N>& r,
             BlockVector<N>& z) const;
  void correct_from_below(std::size_t level, const BlockVector<6>& r, BlockVector<6>& z) const;
  /// Adds the level below one. False if the matrix turned out not positive definite.
  template <int N>
  [[nodiscard]] bool coarsen(const BlockRows<N, N>& matrix, GridLevel<N>& grid,
                             const RigidModes<N>& modes, RigidModes<6>& coarse_modes);
  void build(const RigidModes<3>& modes);
  void factorise_coarsest();

  const BlockRows<3, 3>& finest_;
  GridLevel<3> fine_;
  // Lists that may grow while an entry is in use.
  std::deque<BlockRows<6, 6>> coarse_matrix_;  ///< levels 1, 2, ...
  std::deque<GridLevel<6>> coarse_;            ///< the same without the coarsest
  Eigen::LLT<Eigen::MatrixXd> coarsest_;
  bool definite_ = false;
};

/// Gathers the nodes of a graph into aggregates: a node with all its neighbours where none of them
/// is taken, then the rest to an aggregate next to them. Nodes without neighbours stay out.
struct Aggregates {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<std::uint32_t> of_node;  ///< kNone: in no aggregate
  std::size_t count = 0;
};

/// @param begin, column a symmetric pattern by rows; the diagonal may be in it
[[nodiscard]] Aggregates aggregate(std::span<const std::size_t> begin,
                                   std::span<const std::uint32_t> column);

}  // namespace tpm::organ
