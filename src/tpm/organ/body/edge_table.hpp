#pragma once
#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace tpm::organ {

/// A value for every edge of a mesh, found in the time of an edge's few neighbours.
template <class Value>
class EdgeTable {
 public:
  /// @param vertices numbers of edges' ends are below this
  explicit EdgeTable(std::size_t vertices) : first_(vertices, kNone) {}

  /// Value at the edge of two vertices, in either order; true if it was put there now.
  std::pair<Value&, bool> at(int a, int b, const Value& fresh) {
    const auto [low, high] = std::minmax(a, b);
    std::size_t& first = first_[static_cast<std::size_t>(low)];
    for (std::size_t i = first; i != kNone; i = entries_[i].next) {
      if (entries_[i].other == high) return {entries_[i].value, false};
    }
    entries_.push_back({high, first, fresh});
    first = entries_.size() - 1;
    return {entries_.back().value, true};
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  struct Entry {
    int other;         ///< the higher end
    std::size_t next;  ///< of the same lower end
    Value value;
  };
  std::vector<std::size_t> first_;  ///< entry of each lower end
  std::vector<Entry> entries_;
};

}  // namespace tpm::organ
