#include "tpm/organ/body/mesh_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/base/random.hpp"

namespace tpm::organ {

namespace {

using Eigen::Vector3d;

const double kSmooth = std::sqrt(3.0) / 2.0;  // cosine of 30 degrees

}  // namespace

MeshSurface::MeshSurface(TriangleMesh mesh)
    : tree_(std::move(mesh)), area_(mesh_area(tree_.mesh())), volume_(mesh_volume(tree_.mesh())) {
  const Eigen::Matrix3Xi& triangles = this->mesh().triangles;
  fan_end_.assign(static_cast<std::size_t>(this->mesh().vertices.cols()) + 1, 0);
  fans_.resize(static_cast<std::size_t>(triangles.size()));
  for (const int v : triangles.reshaped()) ++fan_end_[static_cast<std::size_t>(v) + 1];
  std::partial_sum(fan_end_.begin(), fan_end_.end(), fan_end_.begin());
  std::vector<std::size_t> next(fan_end_.begin(), fan_end_.end() - 1);
  for (int t = 0; t < static_cast<int>(triangles.cols()); ++t) {
    for (int which = 0; which < 3; ++which) {
      fans_[next[static_cast<std::size_t>(triangles(which, t))]++] = {t, which};
    }
  }
}

std::span<const MeshSurface::Corner> MeshSurface::fan(int vertex) const {
  const auto v = static_cast<std::size_t>(vertex);
  return std::span(fans_).subspan(fan_end_[v], fan_end_[v + 1] - fan_end_[v]);
}

Vector3d MeshSurface::face(int triangle) const {
  return mesh().area_vector(triangle).normalized();
}

double MeshSurface::angle(const Corner& at) const {
  const Vector3d here = mesh().corner(at.triangle, at.which);
  const Vector3d u = mesh().corner(at.triangle, (at.which + 1) % 3) - here;
  const Vector3d v = mesh().corner(at.triangle, (at.which + 2) % 3) - here;
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

int MeshSurface::beyond(const Corner& edge) const {
  const int end = vertex_of({edge.triangle, (edge.which + 1) % 3});
  const std::span<const Corner> corners = fan(vertex_of(edge));
  // There the edge runs the other way, as in every closed mesh.
  const auto other = std::find_if(corners.begin(), corners.end(), [&](const Corner& at) {
    return vertex_of({at.triangle, (at.which + 2) % 3}) == end;
  });
  return other->triangle;
}

bool MeshSurface::is_crease(const Corner& edge) const {
  return face(edge.triangle).dot(face(beyond(edge))) < kSmooth;
}

bool MeshSurface::on_crease(int vertex) const {
  return std::ranges::any_of(fan(vertex), [&](const Corner& edge) { return is_crease(edge); });
}

Vector3d MeshSurface::mean_normal(const Corner& at, bool smooth) const {
  const Vector3d own = face(at.triangle);
  Vector3d sum = Vector3d::Zero();
  for (const Corner& corner : fan(vertex_of(at))) {
    const Vector3d other = face(corner.triangle);
    if (!smooth || own.dot(other) >= kSmooth) sum += angle(corner) * other;
  }
  return sum.normalized();
}

/// Normal that separates inside from outside at the nearest point (Baerentzen and Aanaes 2005).
Vector3d MeshSurface::pseudonormal(const TrianglePoint& at) const {
  for (int i = 0; i < 3; ++i) {
    const bool before_zero = at.weights[(i + 1) % 3] <= 0.0;
    const bool after_zero = at.weights[(i + 2) % 3] <= 0.0;
    if (before_zero && after_zero) return mean_normal({at.triangle, i}, false);
  }
  for (int i = 0; i < 3; ++i) {
    if (at.weights[(i + 2) % 3] > 0.0) continue;
    return (face(at.triangle) + face(beyond({at.triangle, i}))).normalized();
  }
  return face(at.triangle);
}

Vector3d MeshSurface::normal(const TrianglePoint& at) const {
  for (int i = 0; i < 3; ++i) {
    const Corner corner{at.triangle, i};
    const bool at_corner = at.weights[(i + 1) % 3] <= 0.0 && at.weights[(i + 2) % 3] <= 0.0;
    if (at_corner && on_crease(vertex_of(corner))) return pseudonormal(at);
    if (at.weights[(i + 2) % 3] <= 0.0 && is_crease(corner)) return pseudonormal(at);
  }
  Eigen::Matrix3d smooth;
  for (int i = 0; i < 3; ++i) smooth.col(i) = mean_normal({at.triangle, i}, true);
  return (smooth * at.weights).normalized();
}

SurfacePoint MeshSurface::nearest(const Vector3d& point) const {
  const TrianglePoint at = tree_.nearest(point);
  return {at.position, normal(at)};
}

Vector3d MeshSurface::nearest_position(const Vector3d& point, double within) const {
  return tree_.nearest(point, within).position;
}

Vector3d MeshSurface::nearest_of_moved(const Vector3d& point, double within,
                                       NearParts& near) const {
  return tree_.nearest_of_moved(point, within, near).position;
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
