#include "tpm/network/mesh_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "tpm/core/parallel.hpp"
#include "tpm/core/random.hpp"
#include "tpm/network/edge_table.hpp"

namespace tpm::organ {

namespace {

using Eigen::Vector3d;

const double kSmooth = std::sqrt(3.0) / 2.0;  // cosine of 30 degrees

/// Angle of a triangle at a corner, rad.
double angle_at(const TriangleMesh& mesh, Eigen::Index triangle, Eigen::Index which) {
  const Vector3d u = mesh.corner(triangle, (which + 1) % 3) - mesh.corner(triangle, which);
  const Vector3d v = mesh.corner(triangle, (which + 2) % 3) - mesh.corner(triangle, which);
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// A corner of a triangle.
struct Corner {
  Eigen::Index triangle = 0, which = 0;
};

/// The corners that meet at each vertex, in the order of the triangles.
class Fans {
 public:
  explicit Fans(const TriangleMesh& mesh)
      : end_(static_cast<std::size_t>(mesh.vertices.cols()) + 1, 0),
        corners_(static_cast<std::size_t>(mesh.triangles.size())) {
    for (const int vertex : mesh.triangles.reshaped()) ++end_[static_cast<std::size_t>(vertex) + 1];
    std::partial_sum(end_.begin(), end_.end(), end_.begin());
    std::vector<std::size_t> next(end_.begin(), end_.end() - 1);
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      for (Eigen::Index which = 0; which < 3; ++which) {
        corners_[next[static_cast<std::size_t>(mesh.triangles(which, t))]++] = {t, which};
      }
    }
  }
  [[nodiscard]] std::span<const Corner> of(Eigen::Index vertex) const {
    const auto v = static_cast<std::size_t>(vertex);
    return std::span(corners_).subspan(end_[v], end_[v + 1] - end_[v]);
  }

 private:
  std::vector<std::size_t> end_;  ///< of the corners of the vertex before
  std::vector<Corner> corners_;
};

}  // namespace

MeshSurface::MeshSurface(TriangleMesh mesh)
    : tree_(std::move(mesh)), area_(mesh_area(tree_.mesh())), volume_(mesh_volume(tree_.mesh())) {
  normals_.resize(static_cast<std::size_t>(this->mesh().triangles.cols()));
  Eigen::Matrix3Xd angles(3, this->mesh().triangles.cols());
  for_each_in_parallel(angles.cols(), [&](Eigen::Index t) {
    normals_[static_cast<std::size_t>(t)].face = this->mesh().area_vector(t).normalized();
    for (Eigen::Index which = 0; which < 3; ++which) {
      angles(which, t) = angle_at(this->mesh(), t, which);
    }
  });
  for_each_in_parallel(
      2, [&](int which) { which == 0 ? set_corner_normals(angles) : set_edge_normals(); });
}

void MeshSurface::set_corner_normals(const Eigen::Matrix3Xd& angles) {
  const Fans fans(mesh());
  vertex_normals_.setZero(3, mesh().vertices.cols());
  for (Eigen::Index v = 0; v < vertex_normals_.cols(); ++v) {
    const std::span<const Corner> fan = fans.of(v);
    for (const auto& [t, which] : fan) {
      vertex_normals_.col(v) += angles(which, t) * normals_[static_cast<std::size_t>(t)].face;
    }
    vertex_normals_.col(v).normalize();
    for (const auto& [t, which] : fan) {
      Normals& own = normals_[static_cast<std::size_t>(t)];
      Vector3d sum = Vector3d::Zero();
      for (const Corner& at : fan) {
        const Vector3d& other = normals_[static_cast<std::size_t>(at.triangle)].face;
        if (own.face.dot(other) >= kSmooth) sum += angles(at.which, at.triangle) * other;
      }
      own.smooth.col(which) = sum.normalized();
    }
  }
}

void MeshSurface::set_edge_normals() {
  using Side = std::pair<std::size_t, Eigen::Index>;  // triangle and edge
  EdgeTable<Side> open(static_cast<std::size_t>(mesh().vertices.cols()));
  on_crease_.assign(static_cast<std::size_t>(mesh().vertices.cols()), false);
  for (std::size_t t = 0; t < normals_.size(); ++t) {
    const auto corner = mesh().triangles.col(static_cast<Eigen::Index>(t));
    for (Eigen::Index i = 0; i < 3; ++i) {
      const int from = corner[i];
      const int to = corner[(i + 1) % 3];
      const auto [side, fresh] = open.at(from, to, {t, i});
      if (fresh) continue;
      const auto [other, edge] = side;
      const Vector3d mean = (normals_[t].face + normals_[other].face).normalized();
      const bool crease = normals_[t].face.dot(normals_[other].face) < kSmooth;
      normals_[t].edge.col(i) = mean;
      normals_[other].edge.col(edge) = mean;
      normals_[t].crease[i] = normals_[other].crease[edge] = crease;
      if (crease) {
        on_crease_[static_cast<std::size_t>(from)] = true;
        on_crease_[static_cast<std::size_t>(to)] = true;
      }
    }
  }
}

/// What tells inside from outside at the nearest point (Baerentzen and Aanaes 2005).
Vector3d MeshSurface::pseudonormal(const TrianglePoint& at) const {
  const Normals& own = normals_[static_cast<std::size_t>(at.triangle)];
  for (Eigen::Index i = 0; i < 3; ++i) {
    const bool before_zero = at.weights[(i + 1) % 3] <= 0.0;
    const bool after_zero = at.weights[(i + 2) % 3] <= 0.0;
    if (before_zero && after_zero) return vertex_normals_.col(mesh().triangles(i, at.triangle));
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (at.weights[(i + 2) % 3] <= 0.0) return own.edge.col(i);
  }
  return own.face;
}

Vector3d MeshSurface::normal(const TrianglePoint& at) const {
  const Normals& own = normals_[static_cast<std::size_t>(at.triangle)];
  for (Eigen::Index i = 0; i < 3; ++i) {
    const bool at_corner = at.weights[(i + 1) % 3] <= 0.0 && at.weights[(i + 2) % 3] <= 0.0;
    const auto vertex = static_cast<std::size_t>(mesh().triangles(i, at.triangle));
    if (at_corner && on_crease_[vertex]) return pseudonormal(at);
    if (at.weights[(i + 2) % 3] <= 0.0 && own.crease[i]) return pseudonormal(at);
  }
  return (own.smooth * at.weights).normalized();
}

SurfacePoint MeshSurface::nearest(const Vector3d& point) const {
  const TrianglePoint at = tree_.nearest(point);
  return {at.position, normal(at)};
}

Vector3d MeshSurface::nearest_position(const Vector3d& point, double within) const {
  return tree_.nearest(point, within).position;
}

double MeshSurface::signed_distance(const Vector3d& point) const {
  const TrianglePoint at = tree_.nearest(point);
  const double distance = std::sqrt(at.squared_distance);
  return pseudonormal(at).dot(point - at.position) < 0.0 ? -distance : distance;
}

// Stratified: the k-th point takes the k-th slice of the area, triangle after triangle.
Positions MeshSurface::spread(std::size_t count, std::uint64_t seed) const {
  Random random(seed);
  Positions points(3, static_cast<Eigen::Index>(count));
  const double slice = area_ / static_cast<double>(count);
  const Eigen::Index last = mesh().triangles.cols() - 1;
  Eigen::Index triangle = 0;
  double reached = mesh().area_vector(0).norm();  // area up to the end of this triangle
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const double target = (static_cast<double>(k) + random.uniform()) * slice;
    while (reached < target && triangle < last) reached += mesh().area_vector(++triangle).norm();
    const double root = std::sqrt(random.uniform());
    const double share = random.uniform();
    points.col(k) = (1.0 - root) * mesh().corner(triangle, 0) +
                    root * (1.0 - share) * mesh().corner(triangle, 1) +
                    root * share * mesh().corner(triangle, 2);
  }
  return points;
}

}  // namespace tpm::organ
