#include "tpm/organ/body/neighbours.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nanoflann.hpp>

#include "tpm/base/namespaces.hpp"
#include "tpm/work/parallel.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

/// A set of points as nanoflann reads it.
class PointCloud {
 public:
  explicit PointCloud(const Positions& points) : points_(points) {}
  [[nodiscard]] std::size_t kdtree_get_point_count() const {
    return static_cast<std::size_t>(points_.cols());
  }
  [[nodiscard]] double kdtree_get_pt(std::size_t index, std::size_t axis) const {
    return points_(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(index));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }

 private:
  const Positions& points_;
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointCloud>,
                                                 PointCloud, 3, std::size_t>;

/// Points sorted by the cubes of a grid a little wider than a radius, so that those within the
/// radius of one lie in its own cube and the 26 around it: three cubes side by side along x are one
/// stretch of the order.
class CubeGrid {
 public:
  CubeGrid(const Positions& points, double radius)
      : sorted_(static_cast<std::size_t>(points.cols())), cube_of_(sorted_.size()) {
    const Eigen::Vector3d corner = points.rowwise().minCoeff();
    const double extent = (points.rowwise().maxCoeff() - corner).maxCoeff();
    // Wider by more than a coordinate over a cube may be rounded, and no more cubes than numbers.
    const double cube = std::max(radius * (1.0 + 1e-8), extent / static_cast<double>(kMost));
    std::vector<std::pair<std::uint64_t, std::size_t>> order(sorted_.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      std::uint64_t number = 0;
      for (Eigen::Index axis = 2; axis >= 0; --axis) {
        const auto along = static_cast<std::uint64_t>((points(axis, column) - corner[axis]) / cube);
        number = (number << kBits) | (along + 1);
      }
      order[i] = {number, i};
    }
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const auto [number, point] = order[i];
      sorted_[i] = {number, point, points.col(static_cast<Eigen::Index>(point))};
      if (i == 0 || number != order[i - 1].first) cubes_.push_back({number, {}});
      cube_of_[point] = cubes_.size() - 1;
    }
    for (std::size_t row = 0; row < kRows; ++row) find_stretches(row);
  }

  /// Calls visit(other) for each point of a higher number within the radius.
  template <class Visit>
  void beyond(std::size_t point, const Eigen::Vector3d& at, double squared,
              const Visit& visit) const {
    for (const Stretch& stretch : cubes_[cube_of_[point]].near) {
      for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
        const Sorted& other = sorted_[i];
        if (other.point <= point) continue;
        const Eigen::Vector3d apart = at - other.at;
        if (apart.x() * apart.x() + apart.y() * apart.y() + apart.z() * apart.z() < squared)
          visit(other.point);
      }
    }
  }

 private:
  static constexpr int kBits = 21;  // of a cube's number along an axis, from 1
  static constexpr std::uint64_t kMost = (std::uint64_t{1} << kBits) - 4;
  static constexpr std::size_t kRows = 9;
  struct Sorted {
    std::uint64_t cube = 0;
    std::size_t point = 0;
    Eigen::Vector3d at;
  };
  struct Stretch {
    std::size_t begin = 0, end = 0;
  };
  struct Cube {
    std::uint64_t number = 0;
    std::array<Stretch, kRows> near;
  };

  /// Finds the cubes beside each one in a row along x, which rise as the cubes do.
  void find_stretches(std::size_t row) {
    const std::uint64_t y = row % 3, z = row / 3;
    Stretch stretch;
    for (Cube& cube : cubes_) {
      const std::uint64_t middle =
          cube.number + (y << kBits) + (z << 2 * kBits) - (1ULL << kBits) - (1ULL << 2 * kBits);
      while (stretch.begin < sorted_.size() && sorted_[stretch.begin].cube < middle - 1)
        ++stretch.begin;
      stretch.end = std::max(stretch.begin, stretch.end);
      while (stretch.end < sorted_.size() && sorted_[stretch.end].cube <= middle + 1) ++stretch.end;
      cube.near[row] = stretch;
    }
  }

  std::vector<Sorted> sorted_;
  std::vector<Cube> cubes_;
  std::vector<std::size_t> cube_of_;
};

}  // namespace

std::vector<NeighbourPair> pairs_within(const Positions& points, double radius) {
  if (!std::isfinite(radius) || !(radius > 0.0)) {
    throw bad_input("support radius", fmt::format("{} m", radius), "a length above 0");
  }
  if (points.cols() < 2) return {};
  const CubeGrid grid(points, radius);
  // A point on the radius counts.
  const double squared = std::nextafter(radius * radius, 2.0 * radius * radius);
  constexpr std::size_t kStretch = 512;  // points
  const auto count = static_cast<std::size_t>(points.cols());
  std::vector<std::vector<NeighbourPair>> of_stretch((count + kStretch - 1) / kStretch);
  for_each_in_parallel(of_stretch.size(), [&](std::size_t stretch) {
    std::vector<NeighbourPair>& pairs = of_stretch[stretch];
    for (std::size_t i = stretch * kStretch; i < std::min(count, (stretch + 1) * kStretch); ++i) {
      const std::size_t before = pairs.size();
      grid.beyond(i, points.col(static_cast<Eigen::Index>(i)), squared, [&](std::size_t j) {
        pairs.push_back({i, j});
      });
      std::sort(pairs.begin() + static_cast<std::ptrdiff_t>(before), pairs.end(),
                [](const NeighbourPair& a, const NeighbourPair& b) { return a.second < b.second; });
    }
  });
  std::size_t total = 0;
  for (const auto& pairs : of_stretch) total += pairs.size();
  std::vector<NeighbourPair> all;
  all.reserve(total);
  for (const auto& pairs : of_stretch) all.insert(all.end(), pairs.begin(), pairs.end());
  return all;
}

const std::vector<NeighbourPair>& NearPairs::of(const Positions& points) {
  constexpr double kMargin = 0.5;  // of the reach
  const double margin = kMargin * reach_;
  if (points_.cols() == 0 ||
      (points - points_).colwise().squaredNorm().maxCoeff() > 0.25 * margin * margin) {
    pairs_ = pairs_within(points, reach_ + margin);
    points_ = points;
  }
  return pairs_;
}

std::vector<double> distances_to_nearest(const Positions& points) {
  const PointCloud cloud(points);
  const Tree tree(3, cloud);
  std::vector<double> nearest(cloud.kdtree_get_point_count());
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    std::array<std::size_t, 2> index{};
    std::array<double, 2>
        squared{};  // the point itself, or one at its place, and the nearest other
    tree.knnSearch(points.col(static_cast<Eigen::Index>(i)).data(), 2, index.data(),
                   squared.data());
    nearest[i] = std::sqrt(squared[1]);
  }
  return nearest;
}

}  // namespace tpm::organ
