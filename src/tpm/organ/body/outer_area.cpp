#include "tpm/organ/body/outer_area.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "tpm/organ/body/neighbours.hpp"

namespace tpm::organ {
namespace {

constexpr double kAreaReach = 2.5, kRim = 0.8;  // spacings
constexpr int kCorners = 48;                    // of the disc that ends a cell at a rim
constexpr double kOpposite = -0.3;              // cosine between normals

using Polygon = std::vector<Eigen::Vector2d>;

Polygon disc(double radius) {
  Polygon polygon;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kCorners;
    polygon.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return polygon;
}

/// The part of a convex polygon on the near side of the bisector towards a neighbour.
Polygon cut(const Polygon& polygon, const Eigen::Vector2d& neighbour) {
  const double half = 0.5 * neighbour.squaredNorm();
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    const double from = a.dot(neighbour) - half, to = b.dot(neighbour) - half;
    if (from <= 0.0) kept.push_back(a);
    if ((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0)) {
      kept.emplace_back(a + (b - a) * (from / (from - to)));
    }
  }
  return kept;
}

double area_of(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

}  // namespace

Eigen::VectorXd outer_areas_m2(const Organ& organ) {
  std::vector<Eigen::Index> outer;
  for (std::size_t i = 0; i < organ.size(); ++i) {
    if (organ.layer[i] == 0) outer.push_back(static_cast<Eigen::Index>(i));
  }
  const Positions places = organ.position(Eigen::all, outer);
  std::vector<std::vector<std::size_t>> near(outer.size());
  for (const auto& [a, b] : pairs_within(places, kAreaReach * organ.spacing)) {
    if (organ.normal.col(outer[a]).dot(organ.normal.col(outer[b])) < kOpposite) continue;
    near[a].push_back(b);
    near[b].push_back(a);
  }
  Eigen::VectorXd area = Eigen::VectorXd::Zero(organ.position.cols());
  for (std::size_t i = 0; i < outer.size(); ++i) {
    const Eigen::Vector3d normal = organ.normal.col(outer[i]);
    const Eigen::Vector3d first = normal.unitOrthogonal(), second = normal.cross(first);
    Polygon cell = disc(kRim * organ.spacing);
    for (const std::size_t j : near[i]) {
      const Eigen::Vector3d apart =
          places.col(static_cast<Eigen::Index>(j)) - places.col(static_cast<Eigen::Index>(i));
      const Eigen::Vector2d flat(apart.dot(first), apart.dot(second));
      if (!(flat.norm() > 0.0)) continue;
      cell = cut(cell, flat * (apart.norm() / flat.norm()));
    }
    area[outer[i]] = area_of(cell);
  }
  return area;
}

}  // namespace tpm::organ
