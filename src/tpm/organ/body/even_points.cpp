// Declared in tpm/organ/body/filling.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "tpm/organ/body/filling.hpp"
#include "tpm/organ/body/neighbours.hpp"
#include "tpm/work/parallel.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

/// In spacings, of the repulsion: just above 1, so that it ends where all keep their distance.
constexpr double kReach = 1.05;
constexpr double kOnSurface = 1e-6;  // of a spacing, of a point on the surface
constexpr std::size_t kMost = 1'000'000;
const Eigen::Vector3d kAnyDirection{0.6, 0.48, 0.64};
const double kCell = std::sqrt(3.0) / 2.0;  // area of a point of a triangular lattice of spacing 1

/// Sweeps of the relaxation: the spread gains little after 30, and small organs can afford more.
int sweeps_for(std::size_t count) {
  return count <= 20'000 ? 120 : 30;
}

/// Each point is pushed away from those nearer than the reach, then put back on the surface.
/// @param near reaches as far
/// @param parts of the surface near each point
void repel(const Surface& surface, double spacing, double step, NearPairs& near,
           std::vector<NearParts>& parts, Positions& points) {
  const double reach = kReach * spacing;
  Positions push = Positions::Zero(3, points.cols());
  for (const NeighbourPair& pair : near.of(points)) {
    const auto a = static_cast<Eigen::Index>(pair.first);
    const auto b = static_cast<Eigen::Index>(pair.second);
    const Eigen::Vector3d apart = points.col(b) - points.col(a);
    const double distance = apart.norm();
    if (distance >= reach) continue;
    const double lacking = 1.0 - distance / reach;
    // Two that were pushed into one corner have no direction of their own.
    const Eigen::Vector3d share = distance > 0.0 ? (step * spacing * lacking / distance) * apart
                                                 : step * spacing * kAnyDirection;
    push.col(a) -= share;
    push.col(b) += share;
  }
  for_each_in_parallel(points.cols(), [&](Eigen::Index i) {
    // The point was on the surface, so that this is no farther away than it was pushed.
    const double within = push.col(i).norm() + kOnSurface * spacing;
    points.col(i) = surface.nearest_of_moved(points.col(i) + push.col(i), within,
                                             parts[static_cast<std::size_t>(i)]);
  });
}

}  // namespace

void require_sphere_count(std::size_t count) {
  if (count >= 2 && count <= kMost) return;
  throw bad_input("number of spheres", fmt::format("{}", count), fmt::format("2 to {}", kMost));
}

double even_spacing(double area, std::size_t count) {
  return std::sqrt(area / (kCell * static_cast<double>(count)));
}

double even_spacing(const Surface& surface, std::size_t count) {
  return even_spacing(surface.area(), count);
}

std::size_t even_count(const Surface& surface, double spacing) {
  const double count = std::round(surface.area() / (kCell * spacing * spacing));
  return static_cast<std::size_t>(std::min(count, 1e12));
}

Positions even_points(const Surface& surface, std::size_t count, std::uint64_t seed) {
  Positions points = surface.spread(count, seed);
  if (count < 2) return points;
  const double spacing = even_spacing(surface, count);
  const int sweeps = sweeps_for(count);
  NearPairs near(kReach * spacing);
  std::vector<NearParts> parts(count);
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    // Large steps first to even out the density, small ones at the end to settle.
    const double left = 1.0 - static_cast<double>(sweep) / sweeps;
    repel(surface, spacing, 0.3 + 0.2 * left, near, parts, points);
  }
  return points;
}

Positions sorted_by_x(const Positions& points) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::tuple(points(0, a), points(1, a), points(2, a)) <
           std::tuple(points(0, b), points(1, b), points(2, b));
  });
  return points(Eigen::all, order);
}

void round_to_nanometres(Positions& positions) {
  positions = (positions * 1e9).array().round() / 1e9;
}

}  // namespace tpm::organ
