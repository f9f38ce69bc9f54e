#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tpm/organ/linear/elimination_fronts.hpp"

namespace tpm::organ {

/// Those 3x3 blocks of a symmetric matrix that may differ from 0, and the dense fronts in which it
/// is factorised: found once for a graph, used by every matrix on it.
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
  /// From how many on several threads share a factorisation: some 20 ms of one.
  [[nodiscard]] static std::size_t products_worth_threads() { return 10'000'000; }
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

  /// Columns that a factorisation eliminates at a time: a multiple of 12.
  static constexpr std::size_t kTogether = 48;
  [[nodiscard]] static std::size_t up_to_four(std::size_t size) { return (size + 3) / 4 * 4; }

  /// Where a front stands in the memory of a factorisation; in numbers, not bytes.
  struct Layout {
    std::size_t panel = 0;   ///< its own columns, among those of all fronts
    std::size_t stride = 0;  ///< of the panel's columns
    std::size_t update = 0;  ///< what it leaves to its parent, on the stack of its depth
    std::size_t update_stride = 0;
  };
  /// Fronts [first, end) with all that is below them: they take nothing from other fronts.
  struct Part {
    std::uint32_t first = 0, end = 0;
    std::size_t longest = 0;  ///< coordinates of its longest front
  };
  void choose_parts();
  void lay_out();
  void lay_out(std::uint32_t front, std::array<std::size_t, 2>& top,
               const std::array<std::size_t, 2>& bottom);

  EliminationFronts fronts_;
  std::vector<std::uint32_t> node_of_;  ///< node at each place of the order
  std::vector<std::uint32_t> column_;   ///< first block of each place's column, one more at the end
  std::vector<std::uint32_t> row_;      ///< place of the row of each block, rising in a column
  std::vector<std::uint32_t> front_row_;  ///< the same, counted within the front
  std::vector<Part> parts_;  ///< fronts for as many threads; none where that is not worth it
  std::vector<std::uint32_t> after_;  ///< fronts of no part, which take from those of the parts
  std::vector<Layout> layout_;
  std::size_t panel_numbers_ = 0;
  std::array<std::size_t, 2> stack_numbers_{};  ///< of fronts of even and odd depth
  std::size_t longest_front_ = 0;               ///< coordinates, a multiple of 4; so of each part
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

}  // namespace tpm::organ
