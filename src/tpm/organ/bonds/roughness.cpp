#include "tpm/organ/bonds/roughness.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tpm/base/dense_algebra.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

/// For every sphere those that lateral bonds join to it.
using LateralNeighbours = std::vector<std::vector<std::uint32_t>>;

LateralNeighbours lateral_neighbours(const Network& network) {
  LateralNeighbours neighbours(network.organ.size());
  for (const Bond& bond : network.bonds) {
    if (network.organ.layer[bond.a] != network.organ.layer[bond.b]) continue;
    neighbours[bond.a].push_back(bond.b);
    neighbours[bond.b].push_back(bond.a);
  }
  return neighbours;
}

/// Weight of each neighbour's value in the least-squares fit's value at a sphere.
Eigen::VectorXd shares_of_fit(const Organ& organ, Eigen::Index sphere,
                              const std::vector<std::uint32_t>& neighbours) {
  const Eigen::Vector3d normal = organ.normal.col(sphere);
  const Eigen::Vector3d first = normal.unitOrthogonal();
  const Eigen::Vector3d second = normal.cross(first);
  Eigen::Matrix3Xd place(3, static_cast<Eigen::Index>(neighbours.size()));
  for (Eigen::Index k = 0; k < place.cols(); ++k) {
    const std::uint32_t j = neighbours[static_cast<std::size_t>(k)];
    // In spacings, so that the smallest solution treats value and gradient alike.
    const Eigen::Vector3d apart =
        (organ.position.col(j) - organ.position.col(sphere)) / organ.spacing;
    place.col(k) << 1.0, apart.dot(first), apart.dot(second);
  }
  return shortest_least_squares(place, Eigen::Vector3d::UnitX());
}

}  // namespace

Unevenness::Unevenness(const Network& network, std::span<const std::size_t> spheres) {
  const LateralNeighbours neighbours = lateral_neighbours(network);
  stencils_.reserve(spheres.size());
  for (const std::size_t i : spheres) {
    const auto sphere = static_cast<Eigen::Index>(i);
    Stencil& stencil = stencils_.emplace_back();
    stencil.sphere = sphere;
    stencil.normal = network.organ.normal.col(sphere);
    stencil.neighbours = neighbours.at(i);
    if (stencil.neighbours.empty()) continue;
    stencil.share = shares_of_fit(network.organ, sphere, stencil.neighbours);
  }
}

Eigen::VectorXd Unevenness::of(const Eigen::Matrix3Xd& displacement) const {
  Eigen::VectorXd r = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(stencils_.size()));
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const Stencil& at = stencils_[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k < at.share.size(); ++k) {
      const std::uint32_t j = at.neighbours[static_cast<std::size_t>(k)];
      r[i] -= at.share[k] * at.normal.dot(displacement.col(j) - displacement.col(at.sphere));
    }
  }
  return r;
}

double roughness(const Unevenness& spheres, const Eigen::Matrix3Xd& displacement) {
  const Eigen::VectorXd r = spheres.of(displacement);
  if (r.size() == 0) throw bad_input("roughness", "of no spheres", "at least one");
  const double peak = displacement.colwise().norm().maxCoeff();
  if (!(peak > 0.0)) throw bad_input("roughness", "nothing has moved", "a deformation");
  return std::sqrt(r.squaredNorm() / static_cast<double>(r.size())) / peak;
}

double roughness(const Network& network, const Eigen::Matrix3Xd& displacement,
                 std::span<const std::size_t> spheres) {
  return roughness(Unevenness(network, spheres), displacement);
}

std::vector<std::size_t> spheres_around(const Network& network, std::size_t sphere, int steps) {
  const LateralNeighbours neighbours = lateral_neighbours(network);
  std::vector<std::size_t> found{sphere};
  std::vector<bool> seen(network.organ.size(), false);
  seen.at(sphere) = true;
  std::size_t begin = 0;
  for (int step = 0; step < steps; ++step) {
    const std::size_t end = found.size();
    for (; begin < end; ++begin) {
      for (const std::uint32_t j : neighbours[found[begin]]) {
        if (seen[j]) continue;
        seen[j] = true;
        found.push_back(j);
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::size_t> spheres_at_rim(const Network& network, double angle_rad) {
  const LateralNeighbours neighbours = lateral_neighbours(network);
  const Eigen::Matrix3Xd& normal = network.organ.normal;
  std::vector<std::size_t> rim;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    if (network.organ.layer[i] != 0 || neighbours[i].empty()) continue;
    double sum = 0.0;
    for (const std::uint32_t j : neighbours[i]) {
      const double cosine = normal.col(static_cast<Eigen::Index>(i)).dot(normal.col(j));
      sum += std::acos(std::clamp(cosine, -1.0, 1.0));
    }
    if (sum > angle_rad * static_cast<double>(neighbours[i].size())) rim.push_back(i);
  }
  return rim;
}

}  // namespace tpm::organ
