#include "tpm/network/triangle_tree.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "tpm/core/parallel.hpp"

namespace tpm::organ {

namespace {

constexpr int kLeaf = 4;
constexpr int kAlone = 4096;  // triangles that one thread splits

using Eigen::Vector3d;

/// Without a branch, which AlignedBox's has: where a point lies is not foreseen.
double squared_distance(const Eigen::AlignedBox3d& box, const Vector3d& point) {
  return (box.min() - point).cwiseMax(point - box.max()).cwiseMax(0.0).squaredNorm();
}

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

/// Nodes of the tree over so many triangles.
int nodes_of(int count) {
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
  nodes_.resize(static_cast<std::size_t>(nodes_of(count)));
  std::vector<Eigen::AlignedBox3d> boxes(order_.size());
  packed_.resize(order_.size());
  for_each_in_parallel(order_.size(),
                       [&](std::size_t t) { boxes[t] = box_of(static_cast<int>(t)); });
  split(0, 1, 0, count, boxes);
}

void TriangleTree::pack(int first, int count) {
  for (int at = first; at < first + count; ++at) {
    const int t = order_[static_cast<std::size_t>(at)];
    packed_[static_cast<std::size_t>(at)] = {mesh_.corner(t, 0), mesh_.corner(t, 1),
                                             mesh_.corner(t, 2), mesh_.area_vector(t).normalized()};
  }
}

Eigen::AlignedBox3d TriangleTree::box_of(int triangle) const {
  Eigen::AlignedBox3d box;
  for (Eigen::Index which = 0; which < 3; ++which) box.extend(mesh_.corner(triangle, which));
  return box;
}

void TriangleTree::split(int node, int below, int first, int count,
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
  Node& filled = nodes_[static_cast<std::size_t>(node)];
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
    which == 0 ? split(below, below + 2, first, half, boxes)
               : split(below + 1, below + 1 + nodes_of(half), first + half, count - half, boxes);
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
    int node;
  };
  // Halving leaves at most 31 levels below an int of triangles, each with one node set aside.
  std::array<Open, 64> open;
  std::size_t depth = 0;
  open[depth++] = {0.0, 0};
  while (depth > 0) {
    const auto [bound, index] = open[--depth];
    if (bound >= best.squared_distance) continue;
    const Node& node = nodes_[static_cast<std::size_t>(index)];
    if (node.count == 0) {
      const auto child = [&](int number) {
        const Eigen::AlignedBox3d& box = nodes_[static_cast<std::size_t>(number)].box;
        return Open{squared_distance(box, point), number};
      };
      Open near = child(node.first);
      Open far = child(node.first + 1);
      if (far.bound < near.bound) std::swap(near, far);
      if (far.bound < best.squared_distance) open[depth++] = far;
      if (near.bound < best.squared_distance) open[depth++] = near;
      continue;
    }
    for (int at = node.first; at < node.first + node.count; ++at) {
      const auto& [a, b, c, normal] = packed_[static_cast<std::size_t>(at)];
      const double height = normal.dot(point - a);
      if (height * height >= best.squared_distance) continue;  // its plane is too far already
      const Vector3d weights = nearest_weights(a, b, c, point);
      const Vector3d position = weights[0] * a + weights[1] * b + weights[2] * c;
      const double squared = (position - point).squaredNorm();
      if (squared < best.squared_distance) {
        best = {order_[static_cast<std::size_t>(at)], weights, position, squared};
      }
    }
  }
  return best.triangle >= 0 ? best : nearest(point);
}

std::vector<int> TriangleTree::meeting(const Eigen::AlignedBox3d& box) const {
  std::vector<int> found;
  std::vector<int> open{0};
  while (!open.empty()) {
    const Node& node = nodes_[static_cast<std::size_t>(open.back())];
    open.pop_back();
    if (!node.box.intersects(box)) continue;
    if (node.count == 0) {
      open.push_back(node.first);
      open.push_back(node.first + 1);
      continue;
    }
    for (int at = node.first; at < node.first + node.count; ++at) {
      const int triangle = order_[static_cast<std::size_t>(at)];
      if (box_of(triangle).intersects(box)) found.push_back(triangle);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace tpm::organ
