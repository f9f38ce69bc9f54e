#pragma once
// Closed surfaces with known area, volume and distance, for the tests of the geometry.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/organ/body/surface.hpp"
#include "tpm/organ/body/triangle_mesh.hpp"

namespace tpm::test {
using namespace base;
using namespace organ;

using Triangles = std::vector<Eigen::Vector3i>;

inline TriangleMesh mesh_of(const std::vector<Eigen::Vector3d>& vertices,
                            const Triangles& triangles) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    mesh.vertices.col(static_cast<Eigen::Index>(v)) = vertices[v];
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    mesh.triangles.col(static_cast<Eigen::Index>(t)) = triangles[t];
  }
  return mesh;
}

/// Axis-parallel cuboid from `low` to `high` in 12 triangles.
inline TriangleMesh cuboid(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  std::vector<Eigen::Vector3d> v;
  v.reserve(8);
  for (int i = 0; i < 8; ++i) {
    v.emplace_back((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                   (i & 4) != 0 ? high.z() : low.z());
  }
  const std::vector<std::vector<int>> quads{{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                            {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  Triangles triangles;
  for (const auto& q : quads) {
    triangles.emplace_back(q[0], q[1], q[2]);
    triangles.emplace_back(q[0], q[2], q[3]);
  }
  return mesh_of(v, triangles);
}

inline TriangleMesh unit_cube() {
  return cuboid(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones());
}

/// Both meshes in one, not joined.
inline TriangleMesh both(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, a.vertices.cols() + b.vertices.cols());
  mesh.vertices << a.vertices, b.vertices;
  mesh.triangles.resize(3, a.triangles.cols() + b.triangles.cols());
  mesh.triangles << a.triangles,
      (b.triangles.array() + static_cast<int>(a.vertices.cols())).matrix();
  return mesh;
}

/// A bent bar that bites its own side: connected, closed, and it cuts itself. `rings` are the
/// centres of square cross sections across the given directions.
inline TriangleMesh self_cutting_tube() {
  const std::vector<Eigen::Vector3d> centres{
      {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {2, 4, 0}, {2, -2, 0}};
  const std::vector<Eigen::Vector3d> across{
      {0, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}, {1, 0, 0}};
  std::vector<Eigen::Vector3d> v;
  for (std::size_t r = 0; r < centres.size(); ++r) {
    const Eigen::Vector3d side = 0.5 * across[r];
    const Eigen::Vector3d up(0, 0, 0.5);
    for (const Eigen::Vector3d& offset :
         {Eigen::Vector3d(side + up), Eigen::Vector3d(side - up), Eigen::Vector3d(-side - up),
          Eigen::Vector3d(-side + up)}) {
      v.push_back(centres[r] + offset);
    }
  }
  Triangles triangles{{0, 1, 2}, {0, 2, 3}};
  for (int r = 0; r < 4; ++r) {
    for (int k = 0; k < 4; ++k) {
      const int a = 4 * r + k;
      const int b = 4 * r + (k + 1) % 4;
      triangles.emplace_back(a, a + 4, b);
      triangles.emplace_back(b, a + 4, b + 4);
    }
  }
  triangles.emplace_back(16, 18, 17);
  triangles.emplace_back(16, 19, 18);
  return mesh_of(v, triangles);
}

/// The unit sphere from a cube whose faces are cut into n x n squares.
inline TriangleMesh round_cube(int n) {
  std::vector<Eigen::Vector3d> v;
  Triangles triangles;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const auto first = static_cast<int>(v.size());
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j) {
          // Equal angles, so that the triangles are about the same size.
          Eigen::Vector3d p;
          p[axis] = sign;
          p[(axis + 1) % 3] = std::tan((2.0 * i / n - 1.0) * std::numbers::pi / 4.0);
          p[(axis + 2) % 3] = sign * std::tan((2.0 * j / n - 1.0) * std::numbers::pi / 4.0);
          v.push_back(p.normalized());
        }
      }
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          const int a = first + i * (n + 1) + j;
          triangles.emplace_back(a, a + n + 1, a + 1);
          triangles.emplace_back(a + 1, a + n + 1, a + n + 2);
        }
      }
    }
  }
  return mesh_of(v, triangles);
}

/// A sphere about the origin in closed form.
class Sphere final : public Surface {
 public:
  explicit Sphere(double radius) : radius_(radius) {}
  [[nodiscard]] SurfacePoint nearest(const Eigen::Vector3d& point) const override {
    const Eigen::Vector3d normal =
        point.norm() > 0.0 ? point.normalized() : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
    return {radius_ * normal, normal};
  }
  [[nodiscard]] Eigen::Vector3d nearest_position(const Eigen::Vector3d& point,
                                                 double /*within*/) const override {
    return nearest(point).position;
  }
  [[nodiscard]] double signed_distance(const Eigen::Vector3d& point) const override {
    return point.norm() - radius_;
  }
  [[nodiscard]] Positions spread(std::size_t count, std::uint64_t seed) const override {
    Random random(seed);
    Positions points(3, static_cast<Eigen::Index>(count));
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Eigen::Vector3d p(random.normal(), random.normal(), random.normal());
      points.col(i) = radius_ * p.normalized();
    }
    return points;
  }
  [[nodiscard]] Eigen::AlignedBox3d bounds() const override {
    return {Eigen::Vector3d::Constant(-radius_), Eigen::Vector3d::Constant(radius_)};
  }
  [[nodiscard]] double area() const override { return 4.0 * std::numbers::pi * radius_ * radius_; }
  [[nodiscard]] double volume() const override { return area() * radius_ / 3.0; }

 private:
  double radius_;
};

}  // namespace tpm::test
