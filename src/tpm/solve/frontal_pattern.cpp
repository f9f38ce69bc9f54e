#include "tpm/solve/frontal_pattern.hpp"

#include <algorithm>
#include <numeric>

#include "tpm/core/dense_algebra.hpp"

namespace tpm {
namespace {

using Nodes = std::vector<std::uint32_t>;

/// The nodes along the direction in which they extend furthest.
void sort_along_extent(const Eigen::Matrix3Xd& places, Nodes& nodes) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto node : nodes) mean += places.col(node) / static_cast<double>(nodes.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto node : nodes) {
    const Eigen::Vector3d off = places.col(node) - mean;
    spread += off * off.transpose();
  }
  const Eigen::Vector3d along = symmetric_modes(spread).vectors.col(2);
  std::vector<std::pair<double, std::uint32_t>> keyed;
  keyed.reserve(nodes.size());
  for (const auto node : nodes) keyed.emplace_back(along.dot(places.col(node)), node);
  std::sort(keyed.begin(), keyed.end());
  std::transform(keyed.begin(), keyed.end(), nodes.begin(), [](const auto& k) { return k.second; });
}

class Dissection {
 public:
  Dissection(const Eigen::Matrix3Xd& places, const std::vector<Nodes>& neighbours, std::size_t leaf)
      : places_(places), neighbours_(neighbours), leaf_(leaf), side_(neighbours.size(), kNone) {}

  /// Groups of nodes in the order of elimination.
  [[nodiscard]] std::vector<Nodes> groups() {
    Nodes all(neighbours_.size());
    std::iota(all.begin(), all.end(), 0U);
    cut(std::move(all));
    return std::move(groups_);
  }

 private:
  enum Side : char { kNone, kLeft, kRight };

  void cut(Nodes nodes) {
    if (nodes.empty()) return;
    if (nodes.size() <= leaf_) {
      groups_.push_back(std::move(nodes));
      return;
    }
    sort_along_extent(places_, nodes);
    const auto middle = nodes.begin() + static_cast<std::ptrdiff_t>(nodes.size() / 2);
    for (auto n = nodes.begin(); n != nodes.end(); ++n) side_[*n] = n < middle ? kLeft : kRight;
    Nodes between = take_between(nodes);
    Nodes left, right;
    for (const auto node : nodes) {
      if (side_[node] == kLeft) left.push_back(node);
      if (side_[node] == kRight) right.push_back(node);
      side_[node] = kNone;
    }
    if (left.empty() || right.empty()) {
      groups_.push_back(std::move(nodes));
      return;
    }
    cut(std::move(left));
    cut(std::move(right));
    if (!between.empty()) groups_.push_back(std::move(between));
  }

  [[nodiscard]] std::size_t crossings(std::uint32_t node) const {
    const Side other = side_[node] == kLeft ? kRight : kLeft;
    const auto& near = neighbours_[node];
    return static_cast<std::size_t>(
        std::count_if(near.begin(), near.end(), [&](auto n) { return side_[n] == other; }));
  }

  /// Nodes without which no edge crosses: again and again the one with the most crossings.
  [[nodiscard]] Nodes take_between(const Nodes& nodes) {
    Nodes between;
    for (;;) {
      std::size_t most = 0;
      std::uint32_t best = 0;
      for (const auto node : nodes) {
        if (side_[node] == kNone) continue;
        if (const std::size_t count = crossings(node); count > most) {
          most = count;
          best = node;
        }
      }
      if (most == 0) return between;
      side_[best] = kNone;
      between.push_back(best);
    }
  }

  const Eigen::Matrix3Xd& places_;
  const std::vector<Nodes>& neighbours_;
  std::size_t leaf_;
  std::vector<Side> side_;
  std::vector<Nodes> groups_;
};

void sort_unique(Nodes& nodes) {
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

}  // namespace

FrontalPattern::FrontalPattern(const Eigen::Matrix3Xd& places, std::span<const Edge> edges,
                               std::size_t leaf)
    : edges_(edges.begin(), edges.end()), place_(static_cast<std::size_t>(places.cols())) {
  std::vector<Nodes> neighbours(place_.size());
  for (const auto& [a, b] : edges) {
    neighbours[a].push_back(b);
    neighbours[b].push_back(a);
  }
  for (Nodes& near : neighbours) sort_unique(near);
  const std::vector<Nodes> groups = Dissection(places, neighbours, leaf).groups();
  std::vector<std::uint32_t> front_of(place_.size());  // by place
  std::uint32_t next = 0;
  for (const Nodes& group : groups) {
    Front front;
    front.first = next;
    front.own = static_cast<std::uint32_t>(group.size());
    for (const auto node : group) {
      front_of[next] = static_cast<std::uint32_t>(fronts_.size());
      place_[node] = next++;
    }
    fronts_.push_back(std::move(front));
  }
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    const std::uint32_t end = front.first + front.own;
    for (const auto node : groups[f]) {
      for (const auto other : neighbours[node]) {
        if (place_[other] >= end) front.rows.push_back(place_[other]);
      }
    }
    sort_unique(front.rows);
    front.parent = static_cast<std::uint32_t>(f);
    if (front.rows.empty()) continue;
    front.parent = front_of[front.rows.front()];
    // What this reaches, the front that its rows begin in will reach as well.
    Front& parent = fronts_[front.parent];
    const std::uint32_t parent_end = parent.first + parent.own;
    for (const auto row : front.rows) {
      if (row >= parent_end) parent.rows.push_back(row);
    }
  }
}

std::size_t FrontalPattern::blocks_read() const {
  std::size_t blocks = 0;
  for (const Front& front : fronts_) blocks += front.own * (front.own + 2 * front.rows.size());
  return blocks;
}

}  // namespace tpm
