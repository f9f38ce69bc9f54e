#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace tpm::organ {

/// Elimination of a symmetric matrix with a block per node in dense fronts (multifrontal method;
/// Duff & Reid 1983): which nodes are eliminated together, and which later nodes each front
/// reaches.
///
/// Fronts are the supernodes of the elimination tree, merged with their parents where that adds few
/// zeros (relaxed supernodes; Ashcraft & Grimes 1989), in a postorder: the fronts below one come
/// just before it.
class EliminationFronts {
 public:
  using Edge = std::array<std::uint32_t, 2>;

  /// Nodes [first, first + own) of the order are eliminated together and reach `count` rows.
  struct Front {
    std::uint32_t first = 0, own = 0;
    std::uint32_t rows = 0, count = 0;  ///< entries [rows, rows + count) of row()
    std::uint32_t parent = 0;           ///< front that takes what is left; its own index at a root
    std::uint32_t depth = 0;            ///< 0 at a root
    std::uint32_t child = 0, children = 0;  ///< entries [child, child + children) of child()

    [[nodiscard]] std::uint32_t size() const { return own + count; }
  };

  /// @param nodes number of nodes
  /// @param edges pairs of different nodes, each in any order; repetitions do no harm
  /// Throws as elimination_order.
  EliminationFronts(std::size_t nodes, std::span<const Edge> edges);

  [[nodiscard]] std::size_t nodes() const { return place_.size(); }
  /// Place in the order of elimination of each node.
  [[nodiscard]] std::span<const std::uint32_t> place() const { return place_; }
  /// In the order of elimination.
  [[nodiscard]] std::span<const Front> fronts() const { return fronts_; }
  /// Places that a front reaches, rising, all behind its own.
  [[nodiscard]] std::span<const std::uint32_t> row(const Front& front) const {
    return {row_.data() + front.rows, front.count};
  }
  /// The same of all fronts, one after the other.
  [[nodiscard]] std::span<const std::uint32_t> all_rows() const { return row_; }
  /// Where those stand in the front's parent: its own nodes first, then its rows.
  [[nodiscard]] std::span<const std::uint32_t> row_in_parent(const Front& front) const {
    return {row_in_parent_.data() + front.rows, front.count};
  }
  [[nodiscard]] std::span<const std::uint32_t> child(const Front& front) const {
    return {child_.data() + front.child, front.children};
  }

 private:
  void list_children();
  void find_rows(std::span<const Edge> edges);

  std::vector<std::uint32_t> place_;
  std::vector<Front> fronts_;
  std::vector<std::uint32_t> row_, row_in_parent_, child_;
};

}  // namespace tpm::organ
