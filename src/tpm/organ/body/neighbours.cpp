#include "tpm/organ/body/neighbours.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/work/parallel.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

/// What nanoflann asks of a set of points.
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

}  // namespace

std::vector<NeighbourPair> pairs_within(const Positions& points, double radius) {
  if (!std::isfinite(radius) || !(radius > 0.0)) {
    throw bad_input("support radius", fmt::format("{} m", radius), "a length above 0");
  }
  if (points.cols() < 2) return {};
  const PointCloud cloud(points);
  const Tree tree(3, cloud);
  // The tree keeps what lies strictly inside the squared radius; a point on it counts.
  const double squared = std::nextafter(radius * radius, 2.0 * radius * radius);
  constexpr std::size_t kStretch = 512;  // points
  const std::size_t count = cloud.kdtree_get_point_count();
  std::vector<std::vector<NeighbourPair>> of_stretch((count + kStretch - 1) / kStretch);
  for_each_in_parallel(of_stretch.size(), [&](std::size_t stretch) {
    std::vector<NeighbourPair>& pairs = of_stretch[stretch];
    std::vector<std::pair<std::size_t, double>> found;
    for (std::size_t i = stretch * kStretch; i < std::min(count, (stretch + 1) * kStretch); ++i) {
      const double* centre = points.col(static_cast<Eigen::Index>(i)).data();
      tree.radiusSearch(centre, squared, found, nanoflann::SearchParams(0, 0.0F, false));
      const std::size_t before = pairs.size();
      for (const auto& [j, distance] : found) {
        if (j > i) pairs.push_back({i, j});
      }
      std::sort(pairs.begin() + static_cast<std::ptrdiff_t>(before), pairs.end(),
                [](const NeighbourPair& a, const NeighbourPair& b) { return a.second < b.second; });
    }
  });
  std::vector<NeighbourPair> all;
  for (const auto& pairs : of_stretch) all.insert(all.end(), pairs.begin(), pairs.end());
  return all;
}

const std::vector<NeighbourPair>& NearPairs::of(const Positions& points) {
  constexpr double kMargin = 0.25;  // of the reach
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
