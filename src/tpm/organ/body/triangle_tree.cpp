#include "tpm/organ/body/triangle_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/work/parallel.hpp"

namespace tpm::organ {

namespace {

constexpr int kLeaf = 5;      // the quickest for a liver, building included
constexpr int kAlone = 4096;  // triangles that one thread splits
/// Of lengths that leave triangles out, so that rounding leaves none out that is nearest.
constexpr double kRoundedUp = 1.0 + 1e-9;

/// Of the mesh's extent: of two distances that differ by less, rounding may make either the lesser.
constexpr double kDoubt = 1e-13;
/// Halving leaves at most 31 levels below an int of triangles, three of them to a node, each with
/// all children but one set aside.
constexpr std::size_t kOpen = 96;

using Eigen::Vector3d;

/// Nearest point on the edge from corner `from` to corner `to`, as weights of the three corners.
Vector3d edge_weights(const Vector3d& start, const Vector3d& end, const Vector3d& point,
                      Eigen::Index from, Eigen::Index to) {
  const Vector3d edge = end - start;
  const double share = std::clamp(edge.dot(point - start) / edge.squaredNorm(), 0.0, 1.0);
  Vector3d weights = Vector3d::Zero();
  weights[from] = 1.0 - share;
  weights[to] = share;
  return weights;
}

/// Weights of the corners a, b, c at the point of their triangle nearest to `point`.
Vector3d nearest_weights(const Vector3d& a, const Vector3d& b, const Vector3d& c,
                         const Vector3d& point) {
  const Vector3d normal = (b - a).cross(c - a);
  const double inside_a = normal.dot((b - point).cross(c - point));
  const double inside_b = normal.dot((c - point).cross(a - point));
  const double inside_c = normal.dot((a - point).cross(b - point));
  if (inside_a > 0.0 && inside_b > 0.0 && inside_c > 0.0) {
    const Vector3d inside(inside_a, inside_b, inside_c);
    return inside / inside.sum();
  }
  Vector3d best = Vector3d::Zero();
  double least = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Vector3d& weights) {
    const double squared = (weights[0] * a + weights[1] * b + weights[2] * c - point).squaredNorm();
    if (squared < least) {
      least = squared;
      best = weights;
    }
  };
  if (!(inside_c > 0.0)) consider(edge_weights(a, b, point, 0, 1));
  if (!(inside_a > 0.0)) consider(edge_weights(b, c, point, 1, 2));
  if (!(inside_b > 0.0)) consider(edge_weights(c, a, point, 2, 0));
  return best;
}

/// Nodes of the tree of halves over so many triangles.
int halves_of(int count) {
  if (count <= kLeaf) return 1;
  // Halving leaves parts that differ by one at most: here those beyond a leaf are split once more.
  int parts = 1;
  while ((count - 1) / (2 * kLeaf) >= parts) parts *= 2;
  return 2 * parts - 1 + 2 * std::min(parts, count - kLeaf * parts);
}

}  // namespace

TriangleTree::TriangleTree(TriangleMesh mesh) : mesh_(std::move(mesh)) {
  const auto count = static_cast<int>(mesh_.triangles.cols());
  order_.resize(static_cast<std::size_t>(count));
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<Half> halves(static_cast<std::size_t>(halves_of(count)));
  std::vector<Eigen::AlignedBox3d> boxes(order_.size());
  packed_.resize(order_.size());
  for_each_in_parallel(order_.size(),
                       [&](std::size_t t) { boxes[t] = box_of(static_cast<int>(t)); });
  split(halves, 0, 1, 0, count, boxes);
  bounds_ = halves.front().box;
  nodes_.reserve(halves.size() / kChildren + 1);
  join(halves, 0);
}

int TriangleTree::join(const std::vector<Half>& halves, int half) {
  const auto at = [&](int number) -> const Half& {
    return halves[static_cast<std::size_t>(number)];
  };
  std::array<int, kChildren> children{half};
  std::size_t count = 1;
  for (int round = 2; round <= kChildren; round *= 2) {
    for (std::size_t i = 0, whole = count; i < whole; ++i) {
      const Half& child = at(children[i]);
      if (child.count > 0) continue;
      children[i] = child.first;
      children[count++] = child.first + 1;
    }
  }
  const std::size_t own = nodes_.size();
  nodes_.emplace_back();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    nodes_[own].low[axis].setConstant(kAnywhere);
    nodes_[own].high[axis].setConstant(-kAnywhere);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Half& child = at(children[i]);
    const auto lane = static_cast<Eigen::Index>(i);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      nodes_[own].low[axis][lane] = child.box.min()[static_cast<Eigen::Index>(axis)];
      nodes_[own].high[axis][lane] = child.box.max()[static_cast<Eigen::Index>(axis)];
    }
    const int first = child.count > 0 ? child.first : join(halves, children[i]);
    nodes_[own].first[i] = first;
    nodes_[own].count[i] = child.count;
  }
  return static_cast<int>(own);
}

TriangleTree::OfChildren TriangleTree::squared_distances(const Node& node, const Vector3d& point) {
  OfChildren squared = OfChildren::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = point[static_cast<Eigen::Index>(axis)];
    squared += (node.low[axis] - at).max(at - node.high[axis]).max(0.0).square();
  }
  return squared;
}

void TriangleTree::pack(int first, int count) {
  for (int at = first; at < first + count; ++at) {
    const int t = order_[static_cast<std::size_t>(at)];
    const Vector3d a = mesh_.corner(t, 0), b = mesh_.corner(t, 1), c = mesh_.corner(t, 2);
    const Vector3d centre = (a + b + c) / 3.0;
    const double squared = std::max(
        {(a - centre).squaredNorm(), (b - centre).squaredNorm(), (c - centre).squaredNorm()});
    packed_[static_cast<std::size_t>(at)] = {
        a, b, c, mesh_.area_vector(t).normalized(), centre, kRoundedUp * std::sqrt(squared)};
  }
}

Eigen::AlignedBox3d TriangleTree::box_of(int triangle) const {
  Eigen::AlignedBox3d box;
  for (Eigen::Index which = 0; which < 3; ++which) box.extend(mesh_.corner(triangle, which));
  return box;
}

void TriangleTree::split(std::vector<Half>& halves, int node, int below, int first, int count,
                         const std::vector<Eigen::AlignedBox3d>& boxes) {
  const auto own_box = [&](int t) -> const Eigen::AlignedBox3d& {
    return boxes[static_cast<std::size_t>(t)];
  };
  Eigen::AlignedBox3d box;
  Eigen::AlignedBox3d centres;
  const auto begin = order_.begin() + first;
  for (auto it = begin; it != begin + count; ++it) {
    const Eigen::AlignedBox3d& own = own_box(*it);
    box.extend(own);
    centres.extend(own.center());
  }
  Half& filled = halves[static_cast<std::size_t>(node)];
  filled.box = box;
  filled.first = first;
  filled.count = count;
  if (count <= kLeaf) return pack(first, count);
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const int half = count / 2;
  std::nth_element(begin, begin + half, begin + count, [&](int a, int b) {
    const double left = own_box(a).center()[axis];
    const double right = own_box(b).center()[axis];
    return left != right ? left < right : a < b;
  });
  filled.first = below;
  filled.count = 0;
  const auto split_half = [&](int which) {
    which == 0
        ? split(halves, below, below + 2, first, half, boxes)
        : split(halves, below + 1, below + 1 + halves_of(half), first + half, count - half, boxes);
  };
  if (count > kAlone) return for_each_in_parallel(2, split_half);
  split_half(0);
  split_half(1);
}

TrianglePoint TriangleTree::nearest(const Vector3d& point, double within) const {
  TrianglePoint best;
  best.squared_distance = within * within;
  struct Open {
    double bound;
    int first, count;
  };
  std::array<Open, kOpen> open;
  std::size_t depth = 0;
  double reach = kRoundedUp * within;
  open[depth++] = {0.0, 0, 0};
  while (depth > 0) {
    const auto [bound, first, count] = open[--depth];
    if (bound >= best.squared_distance) continue;
    if (count == 0) {
      const Node& node = nodes_[static_cast<std::size_t>(first)];
      const OfChildren squared = squared_distances(node, point);
      const std::size_t begin = depth;
      for (std::size_t i = 0; i < kChildren; ++i) {
        const double here = squared[static_cast<Eigen::Index>(i)];
        if (!(here < best.squared_distance)) continue;  // also where there is no child
        // The nearest last, to be taken first.
        std::size_t place = depth++;
        for (; place > begin && open[place - 1].bound < here; --place)
          open[place] = open[place - 1];
        open[place] = {here, node.first[i], node.count[i]};
      }
      continue;
    }
    for (int at = first; at < first + count; ++at) {
      const auto& [a, b, c, normal, centre, radius] = packed_[static_cast<std::size_t>(at)];
      if ((centre - point).squaredNorm() > (radius + reach) * (radius + reach)) continue;
      const double height = normal.dot(point - a);
      if (height * height >= best.squared_distance) continue;  // its plane is too far already
      const Vector3d weights = nearest_weights(a, b, c, point);
      const Vector3d position = weights[0] * a + weights[1] * b + weights[2] * c;
      const double squared = (position - point).squaredNorm();
      if (squared < best.squared_distance) {
        best = {order_[static_cast<std::size_t>(at)], weights, position, squared};
        reach = kRoundedUp * std::sqrt(squared);
      }
    }
  }
  return best.triangle >= 0 ? best : nearest(point);
}

TrianglePoint TriangleTree::nearest_beside(const Vector3d& point, double within,
                                           int triangle) const {
  if (triangle < 0 || triangle >= mesh_.triangles.cols()) return nearest(point, within);
  const Vector3d a = mesh_.corner(triangle, 0), b = mesh_.corner(triangle, 1),
                 c = mesh_.corner(triangle, 2);
  const Vector3d normal = (b - a).cross(c - a);
  const Vector3d to_a = a - point, to_b = b - point, to_c = c - point;
  const bool above_it = normal.dot(to_b.cross(to_c)) > 0.0 && normal.dot(to_c.cross(to_a)) > 0.0 &&
                        normal.dot(to_a.cross(to_b)) > 0.0;
  const double distance =
      above_it ? std::abs(normal.dot(to_a)) / normal.norm()
               : std::sqrt(std::min({to_a.squaredNorm(), to_b.squaredNorm(), to_c.squaredNorm()}));
  // Rounding must not leave out that triangle itself, on which the point may lie.
  const double rounding = 1e-12 * bounds_.diagonal().norm();
  return nearest(point, std::min(within, distance + rounding));
}

TrianglePoint TriangleTree::nearest_of_moved(const Vector3d& point, double within,
                                             NearParts& near) const {
  const double moved = near.part < 0 ? kAnywhere : (point - near.place).norm();
  if (moved < near.reach) {
    if (const auto found = nearest_listed(point, near.reach - moved, near)) {
      near.part = found->triangle;
      return *found;
    }
  }
  TrianglePoint found = nearest_beside(point, within, near.part);
  near.part = found.triangle;
  // A list that reaches on is kept: on an edge rounding would have decided.
  if (!(2.0 * moved < near.reach)) list(point, moved, found, near);
  return found;
}

std::optional<TrianglePoint> TriangleTree::nearest_listed(const Vector3d& point, double sure,
                                                          const NearParts& near) const {
  const double doubt = kDoubt * bounds_.diagonal().norm();
  TrianglePoint best;
  best.squared_distance = sure * sure;
  double limit = kRoundedUp * sure + doubt, second = sure;
  for (std::size_t i = 0; i < near.count; ++i) {
    const auto at = static_cast<std::size_t>(near.listed[i]);
    const auto& [a, b, c, normal, centre, radius] = packed_[at];
    if ((centre - point).squaredNorm() > (radius + limit) * (radius + limit)) continue;
    if (std::abs(normal.dot(point - a)) > limit) continue;
    const Vector3d weights = nearest_weights(a, b, c, point);
    const Vector3d position = weights[0] * a + weights[1] * b + weights[2] * c;
    const double squared = (position - point).squaredNorm();
    if (squared >= best.squared_distance) {
      second = std::min(second, std::sqrt(squared));
      continue;
    }
    if (best.triangle >= 0) second = std::min(second, std::sqrt(best.squared_distance));
    best = {order_[at], weights, position, squared};
    limit = kRoundedUp * std::sqrt(squared) + doubt;
  }
  if (best.triangle < 0 || second <= limit) return std::nullopt;
  return best;
}

void TriangleTree::list(const Vector3d& point, double moved, const TrianglePoint& nearest,
                        NearParts& near) const {
  constexpr double kLittle = 0.25, kReach = 0.6;  // of an edge of the nearest triangle
  near.place = point;
  near.reach = 0.0;
  near.count = 0;
  const double edge =
      (mesh_.corner(nearest.triangle, 1) - mesh_.corner(nearest.triangle, 0)).norm();
  const double distance = std::sqrt(nearest.squared_distance);
  // A point that moves farther leaves the list soon, one far from the surface has many beside it.
  if (moved > kLittle * edge || distance > kLittle * edge) return;
  const double reach = distance + kReach * edge;
  struct Open {
    int first, count;
  };
  std::array<Open, kOpen> open;
  std::size_t depth = 0;
  open[depth++] = {0, 0};
  while (depth > 0) {
    const auto [first, count] = open[--depth];
    if (count == 0) {
      const Node& node = nodes_[static_cast<std::size_t>(first)];
      const OfChildren squared = squared_distances(node, point);
      for (std::size_t i = 0; i < kChildren; ++i) {
        if (squared[static_cast<Eigen::Index>(i)] < reach * reach)
          open[depth++] = {node.first[i], node.count[i]};
      }
      continue;
    }
    for (int at = first; at < first + count; ++at) {
      const Packed& packed = packed_[static_cast<std::size_t>(at)];
      const double within = packed.radius + reach;
      if ((packed.centre - point).squaredNorm() > within * within) continue;
      if (std::abs(packed.normal.dot(point - packed.a)) > reach) continue;
      if (near.count == NearParts::kMost) return;
      near.listed[near.count++] = at;
    }
  }
  near.reach = reach / kRoundedUp;
}

std::vector<int> TriangleTree::meeting(const Eigen::AlignedBox3d& box) const {
  std::vector<int> found;
  std::vector<int> open{0};
  while (!open.empty()) {
    const Node& node = nodes_[static_cast<std::size_t>(open.back())];
    open.pop_back();
    for (std::size_t i = 0; i < kChildren; ++i) {
      const auto lane = static_cast<Eigen::Index>(i);
      bool meets = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto along = static_cast<Eigen::Index>(axis);
        meets = meets && node.low[axis][lane] <= box.max()[along] &&
                box.min()[along] <= node.high[axis][lane];
      }
      if (!meets) continue;
      if (node.count[i] == 0) open.push_back(node.first[i]);
      for (int at = node.first[i]; at < node.first[i] + node.count[i]; ++at) {
        const int triangle = order_[static_cast<std::size_t>(at)];
        if (box_of(triangle).intersects(box)) found.push_back(triangle);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace tpm::organ
