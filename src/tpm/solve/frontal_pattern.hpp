#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tpm {

/// An elimination in fronts of a symmetric matrix with one 3x3 block per node: which nodes are
/// eliminated together, as one dense block, and which later nodes each block reaches.
///
/// Nodes have places in space. They are cut in two halves across their longest extent, the nodes
/// that stand between the halves come last, and so on with each half (nested dissection; George,
/// SIAM J. Numer. Anal. 1973). Halves of at most `leaf` nodes become one front.
class FrontalPattern {
 public:
  using Edge = std::array<std::uint32_t, 2>;

  /// Nodes [first, first + own) of the order are eliminated together; they reach `rows`.
  struct Front {
    std::uint32_t first = 0, own = 0;
    std::vector<std::uint32_t> rows;  ///< places in the order, rising, all behind the own ones
    std::uint32_t parent = 0;         ///< front that the rows begin in; its own index at a root
  };

  /// @param places m, a column per node
  /// @param edges pairs of different nodes, in any order, repeated or not
  /// @param leaf 1 or more
  FrontalPattern(const Eigen::Matrix3Xd& places, std::span<const Edge> edges,
                 std::size_t leaf = 10);

  [[nodiscard]] std::size_t nodes() const { return place_.size(); }
  /// Place in the order of elimination of each node.
  [[nodiscard]] std::span<const std::uint32_t> place() const { return place_; }
  /// In the order of elimination.
  [[nodiscard]] std::span<const Front> fronts() const { return fronts_; }
  /// The pairs of nodes given, as given.
  [[nodiscard]] std::span<const Edge> edges() const { return edges_; }
  /// Blocks of 3x3 numbers that a solution reads: pivots whole, once; what they reach, twice.
  [[nodiscard]] std::size_t blocks_read() const;

 private:
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> place_;
  std::vector<Front> fronts_;
};

}  // namespace tpm
