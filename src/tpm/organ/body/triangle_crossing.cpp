// Declared in tpm/organ/body/triangle_mesh.hpp.
// Where triangles of a mesh cut each other, found pair by pair over the tree of bounding boxes.
// Predicates are in double precision: distances below 1e-12 of the triangle's size count as zero,
// and touching counts as cutting, since a body that touches itself has no inside there.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "tpm/organ/body/triangle_mesh.hpp"
#include "tpm/organ/body/triangle_tree.hpp"

namespace tpm::organ {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

constexpr double kCrossRounding = 1e-12;

double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Vector2d u = b - a;
  const Vector2d v = c - a;
  const double cross = u.x() * v.y() - u.y() * v.x();
  return std::abs(cross) <= kCrossRounding * (u.norm() * v.norm()) ? 0.0 : cross;
}

bool segments_meet(const Vector2d& p, const Vector2d& q, const Vector2d& a, const Vector2d& b) {
  const double pa = turn(p, q, a);
  const double pb = turn(p, q, b);
  const double ap = turn(a, b, p);
  const double aq = turn(a, b, q);
  if (pa == 0.0 && pb == 0.0) {
    const Vector2d along = q - p;  // on one line: do the stretches overlap?
    const double from = along.dot(a - p);
    const double to = along.dot(b - p);
    return std::max(from, to) >= 0.0 && std::min(from, to) <= along.squaredNorm();
  }
  return pa * pb <= 0.0 && ap * aq <= 0.0;
}

/// A segment in the plane of a triangle.
bool meets_in_plane(const Vector3d& start, const Vector3d& end, const Corners& triangle,
                    const Vector3d& normal) {
  Eigen::Index drop = 0;
  normal.cwiseAbs().maxCoeff(&drop);
  const auto flat = [drop](const Vector3d& v) {
    return Vector2d(v[(drop + 1) % 3], v[(drop + 2) % 3]);
  };
  const Vector2d p = flat(start);
  const Vector2d q = flat(end);
  const std::array<Vector2d, 3> corner{flat(triangle[0]), flat(triangle[1]), flat(triangle[2])};
  bool all_left = true;
  bool all_right = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector2d& a = corner[i];
    const Vector2d& b = corner[(i + 1) % 3];
    if (segments_meet(p, q, a, b)) return true;
    const double side = turn(a, b, p);
    all_left = all_left && side > 0.0;
    all_right = all_right && side < 0.0;
  }
  return all_left || all_right;
}

bool segment_meets(const Vector3d& start, const Vector3d& end, const Corners& triangle) {
  const Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  const double size = std::max({(triangle[1] - triangle[0]).norm(),
                                (triangle[2] - triangle[0]).norm(), (end - start).norm()});
  const auto height = [&](const Vector3d& p) {
    const double value = normal.dot(p - triangle[0]);
    return std::abs(value) <= kCrossRounding * normal.norm() * size ? 0.0 : value;
  };
  const double from = height(start);
  const double to = height(end);
  if (from == 0.0 && to == 0.0) return meets_in_plane(start, end, triangle, normal);
  if (from * to > 0.0) return false;
  const Vector3d along = end - start;
  double least = 0.0;
  double most = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double side = along.dot((triangle[i] - start).cross(triangle[(i + 1) % 3] - start));
    least = std::min(least, side);
    most = std::max(most, side);
  }
  const double tolerance = kCrossRounding * along.norm() * size * size;
  return least >= -tolerance || most <= tolerance;
}

Corners corners_of(const TriangleMesh& mesh, int triangle) {
  return {mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2)};
}

/// Corners of `a` that are corners of `b` too.
std::array<bool, 3> shared_corners(const TriangleMesh& mesh, int a, int b) {
  std::array<bool, 3> shared{};
  for (std::size_t i = 0; i < 3; ++i) {
    const int vertex = mesh.triangles(static_cast<Eigen::Index>(i), a);
    shared[i] = (mesh.triangles.col(b).array() == vertex).any();
  }
  return shared;
}

/// Two triangles with a common edge cut each other only when one is folded back onto the other.
bool folded(const TriangleMesh& mesh, int a, int b) {
  const Vector3d first = mesh.area_vector(a).normalized();
  const Vector3d second = mesh.area_vector(b).normalized();
  return first.cross(second).norm() <= kCrossRounding && first.dot(second) < 0.0;
}

/// Does an edge of `a` without a corner in `b` meet `b`?
bool free_edge_meets(const TriangleMesh& mesh, int a, int b) {
  const std::array<bool, 3> shared = shared_corners(mesh, a, b);
  const Corners from = corners_of(mesh, a);
  const Corners other = corners_of(mesh, b);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    if (shared[i] || shared[next]) continue;
    if (segment_meets(from[i], from[next], other)) return true;
  }
  return false;
}

bool cross(const TriangleMesh& mesh, int a, int b) {
  const std::array<bool, 3> shared = shared_corners(mesh, a, b);
  const auto common = std::count(shared.begin(), shared.end(), true);
  if (common >= 2) return folded(mesh, a, b);
  return free_edge_meets(mesh, a, b) || free_edge_meets(mesh, b, a);
}

}  // namespace

Eigen::Vector2i first_crossing(const TriangleMesh& mesh) {
  const TriangleTree tree(mesh);
  for (int a = 0; a < static_cast<int>(mesh.triangles.cols()); ++a) {
    for (const int b : tree.meeting(tree.box_of(a))) {
      if (b > a && cross(mesh, a, b)) return {a, b};
    }
  }
  return {-1, -1};
}

}  // namespace tpm::organ
