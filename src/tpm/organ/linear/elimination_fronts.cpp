#include "tpm/organ/linear/elimination_fronts.hpp"

#include <algorithm>
#include <numeric>

#include "tpm/organ/linear/elimination_order.hpp"

namespace tpm::organ {
namespace {

using Numbers = std::vector<std::uint32_t>;

constexpr std::uint32_t kNobody = 0xffffffffU;

/// Lists of one number each after the other.
struct Lists {
  Numbers begin, number;

  [[nodiscard]] std::span<const std::uint32_t> of(std::size_t i) const {
    return {number.data() + begin[i], begin[i + 1] - begin[i]};
  }
};

/// The neighbours of each place, repetitions included.
Lists neighbours(std::span<const std::uint32_t> place,
                 std::span<const EliminationFronts::Edge> edges) {
  Lists lists;
  lists.begin.assign(place.size() + 1, 0);
  for (const auto& [a, b] : edges) {
    ++lists.begin[place[a] + 1];
    ++lists.begin[place[b] + 1];
  }
  std::partial_sum(lists.begin.begin(), lists.begin.end(), lists.begin.begin());
  lists.number.resize(lists.begin.back());
  Numbers next(lists.begin.begin(), lists.begin.end() - 1);
  for (const auto& [a, b] : edges) {
    lists.number[next[place[a]]++] = place[b];
    lists.number[next[place[b]]++] = place[a];
  }
  return lists;
}

/// The elements that name each as their parent, rising; roots name themselves or nobody.
Lists children_of(const Numbers& parent) {
  Lists lists;
  lists.begin.assign(parent.size() + 1, 0);
  const auto is_root = [&](std::uint32_t i) { return parent[i] == kNobody || parent[i] == i; };
  for (std::uint32_t i = 0; i < parent.size(); ++i) {
    if (!is_root(i)) ++lists.begin[parent[i] + 1];
  }
  std::partial_sum(lists.begin.begin(), lists.begin.end(), lists.begin.begin());
  lists.number.resize(lists.begin.back());
  Numbers next(lists.begin.begin(), lists.begin.end() - 1);
  for (std::uint32_t i = 0; i < parent.size(); ++i) {
    if (!is_root(i)) lists.number[next[parent[i]]++] = i;
  }
  return lists;
}

/// A forest by its roots downwards: every element behind all below it.
Numbers postorder(const Numbers& parent, const Lists& children) {
  Numbers order;
  order.reserve(parent.size());
  Numbers stack;
  for (std::uint32_t root = 0; root < parent.size(); ++root) {
    if (parent[root] != kNobody && parent[root] != root) continue;
    // Parents before children, the last child first; read backwards it is a postorder.
    const std::size_t begin = order.size();
    stack.push_back(root);
    while (!stack.empty()) {
      const std::uint32_t at = stack.back();
      stack.pop_back();
      order.push_back(at);
      for (const std::uint32_t child : children.of(at)) stack.push_back(child);
    }
    std::reverse(order.begin() + static_cast<std::ptrdiff_t>(begin), order.end());
  }
  return order;
}

/// The elimination tree (Liu 1986).
Numbers elimination_tree(const Lists& near) {
  const std::size_t n = near.begin.size() - 1;
  Numbers parent(n, kNobody);
  Numbers ancestor(n, kNobody);
  for (std::uint32_t j = 0; j < n; ++j) {
    for (std::uint32_t i : near.of(j)) {
      if (i >= j) continue;
      for (;;) {
        const std::uint32_t above = ancestor[i];
        ancestor[i] = j;
        if (above == j) break;
        if (above == kNobody) {
          parent[i] = j;
          break;
        }
        i = above;
      }
    }
  }
  return parent;
}

/// Blocks below the diagonal of each column of the factor.
Numbers column_counts(const Lists& near, const Numbers& parent) {
  Numbers count(parent.size(), 0);
  Numbers seen_by(parent.size(), kNobody);
  for (std::uint32_t row = 0; row < parent.size(); ++row) {
    seen_by[row] = row;
    for (std::uint32_t i : near.of(row)) {
      if (i >= row) continue;
      for (; seen_by[i] != row; i = parent[i]) {
        seen_by[i] = row;
        ++count[i];
      }
    }
  }
  return count;
}

/// A supernode while supernodes are merged.
struct Supernode {
  Numbers own;  ///< columns, of all that were merged into it
  std::uint32_t count = 0;
  std::uint32_t parent = kNobody;
  double zeros = 0.0;  ///< blocks that are stored and 0
  bool merged = false;
};

double trapezoid(double own, double count) {
  return 0.5 * own * (own + 1.0) + own * count;
}

/// Blocks of zeros that are worth it in parts of all, for the sake of longer loops.
double allowed_zeros(double own) {
  if (own <= 3.0) return 1.0;
  if (own <= 8.0) return 0.4;
  if (own <= 16.0) return 0.15;
  return 0.05;
}

/// Columns with the same rows below them, each set as one.
std::vector<Supernode> equal_columns(const Numbers& parent, const Numbers& count) {
  std::vector<Supernode> found;
  Numbers of_column(parent.size());
  for (std::uint32_t j = 0; j < parent.size(); ++j) {
    const bool continues = j > 0 && parent[j - 1] == j && count[j - 1] == count[j] + 1;
    if (!continues) found.emplace_back();
    found.back().own.push_back(j);
    found.back().count = count[j];
    of_column[j] = static_cast<std::uint32_t>(found.size() - 1);
  }
  for (Supernode& node : found) {
    const std::uint32_t above = parent[node.own.back()];
    if (above != kNobody) node.parent = of_column[above];
  }
  return found;
}

/// Merges supernodes into their parents, upwards, those first that add the fewest zeros.
class UpwardMerge {
 public:
  explicit UpwardMerge(std::vector<Supernode>& nodes) : nodes_(nodes), below_(nodes.size()) {
    for (std::uint32_t s = 0; s < nodes.size(); ++s) {
      if (nodes[s].parent != kNobody) below_[nodes[s].parent].push_back(s);
    }
  }

  void run() {
    for (std::uint32_t p = 0; p < nodes_.size(); ++p) merge_into(p);
  }

 private:
  [[nodiscard]] double own(std::uint32_t s) const {
    return static_cast<double>(nodes_[s].own.size());
  }
  /// Zeros of a child and its parent as one.
  [[nodiscard]] double zeros_together(std::uint32_t p, std::uint32_t child) const {
    return nodes_[p].zeros + nodes_[child].zeros + trapezoid(own(p) + own(child), nodes_[p].count) -
           trapezoid(own(p), nodes_[p].count) - trapezoid(own(child), nodes_[child].count);
  }

  void merge_into(std::uint32_t p) {
    Numbers candidates = std::move(below_[p]);
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](auto a, auto b) { return zeros_together(p, a) < zeros_together(p, b); });
    for (std::size_t i = 0; i < candidates.size(); ++i) {  // those below a merged one join
      const std::uint32_t child = candidates[i];
      const double zeros = zeros_together(p, child);
      const double together = own(p) + own(child);
      if (zeros > allowed_zeros(together) * trapezoid(together, nodes_[p].count)) {
        below_[p].push_back(child);
        continue;
      }
      Supernode& above = nodes_[p];
      above.zeros = zeros;
      above.own.insert(above.own.end(), nodes_[child].own.begin(), nodes_[child].own.end());
      nodes_[child].merged = true;
      for (const std::uint32_t grandchild : below_[child]) {
        nodes_[grandchild].parent = p;
        candidates.push_back(grandchild);
      }
    }
    std::sort(nodes_[p].own.begin(), nodes_[p].own.end());
  }

  std::vector<Supernode>& nodes_;
  std::vector<Numbers> below_;  ///< what is left below each
};

/// The columns of an elimination tree in a postorder.
Numbers in_postorder(const Numbers& place, std::span<const EliminationFronts::Edge> edges) {
  const Numbers parent = elimination_tree(neighbours(place, edges));
  const Numbers order = postorder(parent, children_of(parent));
  Numbers rank(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  Numbers sorted(place.size());
  for (std::size_t node = 0; node < place.size(); ++node) sorted[node] = rank[place[node]];
  return sorted;
}

/// Merged supernodes of columns in a postorder, each behind those below it.
std::vector<Supernode> relaxed_supernodes(const Lists& near) {
  const Numbers parent = elimination_tree(near);
  std::vector<Supernode> all = equal_columns(parent, column_counts(near, parent));
  UpwardMerge(all).run();
  Numbers kept;
  Numbers number(all.size(), kNobody);
  for (std::uint32_t s = 0; s < all.size(); ++s) {
    if (all[s].merged) continue;
    number[s] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(s);
  }
  Numbers above(kept.size(), kNobody);
  for (std::uint32_t k = 0; k < kept.size(); ++k) {
    const std::uint32_t p = all[kept[k]].parent;
    if (p != kNobody) above[k] = number[p];
  }
  const Numbers order = postorder(above, children_of(above));
  Numbers rank(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  std::vector<Supernode> sorted;
  sorted.reserve(order.size());
  for (const std::uint32_t k : order) {
    sorted.push_back(std::move(all[kept[k]]));
    sorted.back().parent = above[k] == kNobody ? kNobody : rank[above[k]];
  }
  return sorted;
}

}  // namespace

EliminationFronts::EliminationFronts(std::size_t nodes, std::span<const Edge> edges) {
  const Numbers column = in_postorder(elimination_order(nodes, edges), edges);
  const std::vector<Supernode> supernodes = relaxed_supernodes(neighbours(column, edges));
  Numbers place_of_column(nodes);
  for (const Supernode& node : supernodes) {
    Front front;
    front.first = fronts_.empty() ? 0 : fronts_.back().first + fronts_.back().own;
    front.own = static_cast<std::uint32_t>(node.own.size());
    const auto number = static_cast<std::uint32_t>(fronts_.size());
    front.parent = node.parent == kNobody ? number : node.parent;
    for (std::uint32_t i = 0; i < front.own; ++i) place_of_column[node.own[i]] = front.first + i;
    fronts_.push_back(front);
  }
  place_.resize(nodes);
  for (std::size_t i = 0; i < nodes; ++i) place_[i] = place_of_column[column[i]];
  list_children();
  find_rows(edges);
}

void EliminationFronts::list_children() {
  Numbers parent;
  parent.reserve(fronts_.size());
  for (const Front& front : fronts_) parent.push_back(front.parent);
  Lists lists = children_of(parent);
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    Front& front = fronts_[f];
    front.depth = front.parent == f ? 0 : fronts_[front.parent].depth + 1;
    front.child = lists.begin[f];
    front.children = lists.begin[f + 1] - lists.begin[f];
  }
  child_ = std::move(lists.number);
}

void EliminationFronts::find_rows(std::span<const Edge> edges) {
  const Lists near = neighbours(place_, edges);
  Numbers seen_by(nodes(), kNobody);
  for (std::uint32_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    const std::uint32_t end = front.first + front.own;
    front.rows = static_cast<std::uint32_t>(row_.size());
    const auto reach = [&](std::uint32_t place) {
      if (place < end || seen_by[place] == f) return;
      seen_by[place] = f;
      row_.push_back(place);
    };
    for (std::uint32_t p = front.first; p < end; ++p) {
      for (const std::uint32_t other : near.of(p)) reach(other);
    }
    for (const std::uint32_t c : child(front)) {
      // By number: the list grows while it is read.
      for (std::uint32_t i = 0; i < fronts_[c].count; ++i) reach(row_[fronts_[c].rows + i]);
    }
    std::sort(row_.begin() + front.rows, row_.end());
    front.count = static_cast<std::uint32_t>(row_.size()) - front.rows;
  }
  row_in_parent_.resize(row_.size());
  for (const Front& front : fronts_) {
    const Front& parent = fronts_[front.parent];
    const std::span<const std::uint32_t> into = row(parent);
    auto at = into.begin();
    for (std::uint32_t i = 0; i < front.count; ++i) {
      const std::uint32_t place = row_[front.rows + i];
      if (place < parent.first + parent.own) {
        row_in_parent_[front.rows + i] = place - parent.first;
        continue;
      }
      at = std::lower_bound(at, into.end(), place);
      row_in_parent_[front.rows + i] = parent.own + static_cast<std::uint32_t>(at - into.begin());
    }
  }
}

}  // namespace tpm::organ
