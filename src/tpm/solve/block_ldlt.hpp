#pragma once
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tpm/solve/dense_update.hpp"
#include "tpm/solve/elimination_fronts.hpp"
#include "tpm/solve/zeroed_numbers.hpp"

namespace tpm {

/// Which 3x3 blocks of a symmetric matrix may differ from 0, and the dense fronts in which it is
/// factorised: found once for a graph, used by every matrix on it.
class BlockPattern {
 public:
  /// @param nodes number of 3x3 blocks on the diagonal
  /// @param edges pairs of different nodes, each in any order; repetitions do no harm
  /// Throws as elimination_order.
  BlockPattern(std::size_t nodes, std::span<const std::array<std::uint32_t, 2>> edges);

  [[nodiscard]] std::size_t nodes() const { return fronts_.nodes(); }
  /// Blocks below the diagonal of the matrix.
  [[nodiscard]] std::size_t matrix_blocks() const { return row_.size(); }
  /// Blocks below the diagonal of the factor.
  [[nodiscard]] std::size_t factor_blocks() const { return factor_blocks_; }
  /// Multiplications of 3x3 blocks that a factorisation takes.
  [[nodiscard]] std::size_t factor_products() const { return products_; }
  /// Bytes that a BlockLdlt on this pattern takes.
  [[nodiscard]] std::size_t factor_bytes() const;

  /// Where the block of two nodes stands among the blocks below the diagonal of a BlockMatrix.
  struct Place {
    std::uint32_t index = 0;
    bool transposed = false;  ///< the block (b, a) stands there, not (a, b)
  };
  /// Throws std::out_of_range for nodes that are not neighbours.
  [[nodiscard]] Place place(std::uint32_t a, std::uint32_t b) const;

 private:
  friend class BlockLdlt;
  friend class LaneFactor;

  /// Where a front stands in the memory of a factorisation; in numbers, not bytes.
  struct Layout {
    std::size_t panel = 0;   ///< its own columns, among those of all fronts
    std::size_t stride = 0;  ///< of the panel's columns
    std::size_t update = 0;  ///< what it leaves to its parent, on the stack of its depth
    std::size_t update_stride = 0;
  };
  void lay_out();

  EliminationFronts fronts_;
  std::vector<std::uint32_t> node_of_;  ///< node at each place of the order
  std::vector<std::uint32_t> column_;   ///< first block of each place's column, one more at the end
  std::vector<std::uint32_t> row_;      ///< place of the row of each block, rising in a column
  std::vector<std::uint32_t> front_row_;  ///< the same, counted within the front
  std::vector<Layout> layout_;
  std::size_t panel_numbers_ = 0;
  std::array<std::size_t, 2> stack_numbers_{};  ///< of fronts of even and odd depth
  std::size_t longest_front_ = 0;               ///< coordinates, a multiple of 4
  std::size_t factor_blocks_ = 0, products_ = 0;
};

/// A symmetric matrix of 3x3 blocks on a pattern: the diagonal and what lies below it, in the order
/// of elimination.
struct BlockMatrix {
  explicit BlockMatrix(const BlockPattern& pattern)
      : diagonal(pattern.nodes(), Eigen::Matrix3d::Zero()),
        below(pattern.matrix_blocks(), Eigen::Matrix3d::Zero()) {}
  void set_zero();

  std::vector<Eigen::Matrix3d> diagonal;  ///< of each node, in the order of the nodes
  std::vector<Eigen::Matrix3d> below;     ///< where BlockPattern::place says
};

/// L D L^T of a symmetric matrix with 3x3 pivots, without exchange of rows: stable for positive
/// definite matrices, and for others good enough to count signs.
///
/// Multifrontal: the columns of a front are one dense panel, and what they leave to later columns
/// is one dense matrix, which is added to the parent's. In a panel 48 columns are eliminated at a
/// time; all else is products of dense matrices (DenseUpdate).
///
/// factorise() and solve() allocate nothing.
class BlockLdlt {
 public:
  /// @param pattern must live as long as this
  /// @param portable does without what not every processor has: for tests
  explicit BlockLdlt(const BlockPattern& pattern, bool portable = false);

  /// False if a pivot cannot be inverted or is not finite; the factor is then of no use.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix);
  /// Of the last factorisation: eigenvalues below 0 that the matrix has (Sylvester's law).
  [[nodiscard]] std::size_t negative_count() const { return negative_; }

  /// Replaces the right-hand side, one column per node, by the solution.
  void solve(Eigen::Ref<Eigen::Matrix3Xd> x) const;

 private:
  friend class LaneFactor;
  /// A front while it is eliminated.
  struct Work {
    DensePanel panel, update;
    std::uint32_t first;       ///< place
    std::size_t own, reached;  ///< coordinates
  };
  [[nodiscard]] Work work_on(std::size_t front);
  void gather(const BlockMatrix& matrix, std::size_t front, const Work& work);
  void add_child(const EliminationFronts::Front& child, const DensePanel& from, const Work& work);
  [[nodiscard]] bool eliminate(const Work& work);
  [[nodiscard]] bool eliminate_diagonal(const DensePanel& block, std::size_t size,
                                        std::uint32_t place);
  void invert_lower(const DensePanel& block, std::size_t size);
  void scale_columns(const DensePanel& from, std::size_t rows, std::size_t columns,
                     std::uint32_t place, const DensePanel& to) const;
  [[nodiscard]] bool invert_pivot(std::uint32_t place);

  const BlockPattern& pattern_;
  const DenseUpdate& update_;
  ZeroedNumbers panels_;                          ///< L of each front, its own coordinates first
  std::array<ZeroedNumbers, 2> stacks_;           ///< what fronts leave to their parents
  std::vector<Eigen::Matrix3d> pivot_, inverse_;  ///< by place
  std::vector<double> scaled_;                    ///< L D of the columns being eliminated
  std::vector<double> lower_inverse_;             ///< minus the inverse of L on the diagonal
  mutable Eigen::Matrix3Xd permuted_;
  mutable std::vector<double> local_;  ///< of a front, in solve()
  std::size_t negative_ = 0;
};

}  // namespace tpm
