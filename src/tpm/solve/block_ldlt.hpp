#pragma once
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tpm {

/// Which 3x3 blocks of a symmetric matrix may differ from 0, and where a factorisation of it fills
/// in: found once for a graph, used by every matrix on it.
///
/// Nodes are reordered by approximate minimum degree (Eigen's AMDOrdering), which decides fill but
/// no result beyond rounding.
class BlockPattern {
 public:
  /// @param nodes number of 3x3 blocks on the diagonal
  /// @param edges pairs of different nodes, each in any order; repetitions do no harm
  BlockPattern(std::size_t nodes, std::span<const std::array<std::uint32_t, 2>> edges);

  [[nodiscard]] std::size_t nodes() const { return order_.size(); }
  /// Blocks below the diagonal of the factor.
  [[nodiscard]] std::size_t factor_blocks() const { return row_.size(); }
  /// Multiplications of 3x3 blocks that a factorisation takes.
  [[nodiscard]] std::size_t factor_products() const { return products_; }

  /// Where the block of two nodes stands among the blocks below the diagonal.
  struct Place {
    std::uint32_t index = 0;
    bool transposed = false;  ///< the block (b, a) stands there, not (a, b)
  };
  /// Throws std::out_of_range for nodes that are not neighbours.
  [[nodiscard]] Place place(std::uint32_t a, std::uint32_t b) const;

 private:
  friend class BlockLdlt;
  friend class LaneFactor;

  /// An entry of a row of the factor, met while its column is updated.
  struct RowEntry {
    std::uint32_t column;
    std::uint32_t index;
  };

  std::vector<std::uint32_t> order_;      ///< place in the factor of each node
  std::vector<std::uint32_t> column_;     ///< first block of each column, one more at the end
  std::vector<std::uint32_t> row_;        ///< row of each block, rising in a column
  std::vector<std::uint32_t> row_begin_;  ///< first entry of each row, one more at the end
  std::vector<RowEntry> row_entry_;
  std::size_t products_ = 0;
};

/// A symmetric matrix of 3x3 blocks on a pattern: the diagonal and what lies below it, in the order
/// of the factor.
struct BlockMatrix {
  explicit BlockMatrix(const BlockPattern& pattern)
      : diagonal(pattern.nodes(), Eigen::Matrix3d::Zero()),
        below(pattern.factor_blocks(), Eigen::Matrix3d::Zero()) {}
  void set_zero();

  std::vector<Eigen::Matrix3d> diagonal;  ///< of each node, in the order of the nodes
  std::vector<Eigen::Matrix3d> below;     ///< where BlockPattern::place says
};

/// A 3x3 block by columns, each filled up with a 0: vectors of the processor.
struct alignas(32) PaddedBlock {
  std::array<double, 12> column{};

  [[nodiscard]] auto matrix() const {
    return Eigen::Map<const Eigen::Matrix3d, 0, Eigen::OuterStride<4>>(column.data());
  }
  [[nodiscard]] auto matrix() {
    return Eigen::Map<Eigen::Matrix3d, 0, Eigen::OuterStride<4>>(column.data());
  }
};

/// L D L^T of a symmetric matrix with 3x3 pivots, without exchange of rows: stable for positive
/// definite matrices, and for others good enough to count signs.
///
/// factorise() and solve() allocate nothing.
class BlockLdlt {
 public:
  /// @param pattern must live as long as this
  explicit BlockLdlt(const BlockPattern& pattern);

  /// False if a pivot cannot be inverted or is not finite; the factor is then of no use.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix);
  /// Of the last factorisation: eigenvalues below 0 that the matrix has (Sylvester's law).
  [[nodiscard]] std::size_t negative_count() const { return negative_; }

  /// Replaces the right-hand side, one column per node, by the solution.
  void solve(Eigen::Ref<Eigen::Matrix3Xd> x) const;

 private:
  friend class LaneFactor;
  void gather_column(const BlockMatrix& matrix, std::uint32_t column);
  void eliminate_before(std::uint32_t column);
  [[nodiscard]] bool invert_pivot(std::uint32_t column);

  const BlockPattern& pattern_;
  std::vector<std::uint32_t> node_of_;  ///< node at each place of the factor
  std::vector<PaddedBlock> lower_;      ///< L, in the places of the pattern
  std::vector<Eigen::Matrix3d> pivot_, inverse_;
  std::vector<PaddedBlock> work_;  ///< a column being updated, by row
  mutable Eigen::Matrix3Xd permuted_;
  std::size_t negative_ = 0;
};

}  // namespace tpm
