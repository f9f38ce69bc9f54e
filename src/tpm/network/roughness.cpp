#include "tpm/network/roughness.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tpm/core/dense_algebra.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {
namespace {

double unevenness(const Organ& organ, const Eigen::Matrix3Xd& displacement, Eigen::Index sphere,
                  const std::vector<std::uint32_t>& neighbours) {
  if (neighbours.empty()) return 0.0;
  const Eigen::Vector3d normal = organ.normal.col(sphere);
  const Eigen::Vector3d first = normal.unitOrthogonal();
  const Eigen::Vector3d second = normal.cross(first);
  const auto n = static_cast<Eigen::Index>(neighbours.size());
  Eigen::MatrixX3d place(n, 3);
  Eigen::VectorXd value(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const std::uint32_t j = neighbours[static_cast<std::size_t>(k)];
    // In spacings, so that the smallest solution treats value and gradient alike.
    const Eigen::Vector3d apart =
        (organ.position.col(j) - organ.position.col(sphere)) / organ.spacing;
    place.row(k) << 1.0, apart.dot(first), apart.dot(second);
    value[k] = normal.dot(displacement.col(j) - displacement.col(sphere));
  }
  return -shortest_least_squares(place, value)(0, 0);
}

}  // namespace

LateralNeighbours lateral_neighbours(const Network& network) {
  LateralNeighbours neighbours(network.organ.size());
  for (const Bond& bond : network.bonds) {
    if (network.organ.layer[bond.a] != network.organ.layer[bond.b]) continue;
    neighbours[bond.a].push_back(bond.b);
    neighbours[bond.b].push_back(bond.a);
  }
  return neighbours;
}

Eigen::VectorXd normal_unevenness_m(const Network& network, const Eigen::Matrix3Xd& displacement) {
  const LateralNeighbours neighbours = lateral_neighbours(network);
  Eigen::VectorXd r(displacement.cols());
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    r[i] = unevenness(network.organ, displacement, i, neighbours[static_cast<std::size_t>(i)]);
  }
  return r;
}

double roughness(const Network& network, const LateralNeighbours& neighbours,
                 const Eigen::Matrix3Xd& displacement, std::span<const std::size_t> spheres) {
  if (spheres.empty()) throw bad_input("roughness", "of no spheres", "at least one");
  const double peak = displacement.colwise().norm().maxCoeff();
  if (!(peak > 0.0)) throw bad_input("roughness", "nothing has moved", "a deformation");
  double sum = 0.0;
  for (const std::size_t i : spheres) {
    const double value =
        unevenness(network.organ, displacement, static_cast<Eigen::Index>(i), neighbours[i]);
    sum += value * value;
  }
  return std::sqrt(sum / static_cast<double>(spheres.size())) / peak;
}

double roughness(const Network& network, const Eigen::Matrix3Xd& displacement,
                 std::span<const std::size_t> spheres) {
  return roughness(network, lateral_neighbours(network), displacement, spheres);
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
