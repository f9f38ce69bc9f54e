#include "tpm/organ/body/solid_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "tpm/organ/body/neighbours.hpp"

namespace tpm::organ {
namespace {

using Eigen::Vector3d;

constexpr double kApart = 0.62;   // least distance of an added sphere from all others, in spacings
constexpr double kEnough = 0.8;   // farther from the others than this is no better
constexpr double kNearest = 0.5;  // of an added sphere to the surface, in spacings
constexpr std::array<double, 4> kDepths{0.8, 0.9, 0.7, 1.0};  // below its sphere, the best first
constexpr std::array<double, 3> kAslant{0.0, 0.3, 0.6};       // beside it
constexpr int kTurns = 8;

/// Inner spheres within reach of each outer one.
std::vector<int> inside_of_outer(const Positions& outer, const Positions& inner, double spacing) {
  Positions all(3, outer.cols() + inner.cols());
  all << outer, inner;
  const auto count = static_cast<std::size_t>(outer.cols());
  std::vector<int> inside(count, 0);
  for (const NeighbourPair& pair : pairs_within(all, kSolidReach * spacing)) {
    if (pair.first < count && pair.second >= count) ++inside[pair.first];
  }
  return inside;
}

/// The spheres near the surface and the places that are added below it.
class Below {
 public:
  Below(const Surface& surface, const Positions& outer, const Eigen::Matrix3Xd& normal,
        const Positions& inner, double spacing)
      : surface_(surface), normal_(normal), spacing_(spacing), outer_(outer.cols()) {
    place_.reserve(static_cast<std::size_t>(outer.cols() + inner.cols()));
    for (Eigen::Index i = 0; i < outer.cols(); ++i) place_.emplace_back(outer.col(i));
    for (Eigen::Index i = 0; i < inner.cols(); ++i) place_.emplace_back(inner.col(i));
    first_added_ = place_.size();
    near_.resize(static_cast<std::size_t>(outer_));
    Positions all(3, outer.cols() + inner.cols());
    all << outer, inner;
    // A place lies within 1.2 spacings of its sphere and asks for others 0.8 spacings farther on.
    for (const NeighbourPair& pair : pairs_within(all, kSeen * spacing)) {
      if (is_outer(pair.first)) near_[pair.first].push_back(pair.second);
      if (is_outer(pair.second)) near_[pair.second].push_back(pair.first);
    }
  }

  [[nodiscard]] int inside(std::size_t sphere) const {
    return static_cast<int>(
        std::count_if(near_[sphere].begin(), near_[sphere].end(), [&](std::size_t other) {
          return !is_outer(other) &&
                 (place_[other] - place_[sphere]).norm() <= kSolidReach * spacing_;
        }));
  }

  /// Whether there was a place.
  bool add_below(std::size_t sphere) {
    const std::optional<Vector3d> place = best_below(sphere);
    if (!place) return false;
    const std::size_t added = place_.size();
    place_.push_back(*place);
    near_[sphere].push_back(added);
    // The others that see it lie beside this sphere: within a place's reach and their own.
    for (const std::size_t other : std::vector<std::size_t>(near_[sphere])) {
      if (is_outer(other)) near_[other].push_back(added);
    }
    return true;
  }

  [[nodiscard]] Positions added() const {
    Positions points(3, static_cast<Eigen::Index>(place_.size() - first_added_));
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      points.col(i) = place_[first_added_ + static_cast<std::size_t>(i)];
    }
    return points;
  }
  [[nodiscard]] std::size_t added_count() const { return place_.size() - first_added_; }

 private:
  static constexpr double kSeen = 2.8;  // spacings

  [[nodiscard]] bool is_outer(std::size_t sphere) const {
    return static_cast<Eigen::Index>(sphere) < outer_;
  }

  [[nodiscard]] std::optional<Vector3d> best_below(std::size_t sphere) const {
    const Vector3d inward = -normal_.col(static_cast<Eigen::Index>(sphere));
    const Vector3d side = inward.unitOrthogonal();
    const Vector3d across = inward.cross(side);
    std::optional<Vector3d> best;
    double farthest = kApart;
    for (const double aslant : kAslant) {
      for (const double depth : kDepths) {
        for (int turn = 0; turn < (aslant > 0.0 ? kTurns : 1); ++turn) {
          const double angle = 2.0 * std::numbers::pi * turn / kTurns;
          const Vector3d place =
              place_[sphere] + spacing_ * (depth * inward + aslant * (std::cos(angle) * side +
                                                                      std::sin(angle) * across));
          const double distance = distance_to_others(sphere, place);
          if (distance <= farthest * (1.0 + 1e-9)) continue;  // a later one must be better
          if (-surface_.signed_distance(place) < kNearest * spacing_) continue;
          farthest = distance;
          best = place;
        }
      }
    }
    return best;
  }

  /// In spacings, at most kEnough.
  [[nodiscard]] double distance_to_others(std::size_t sphere, const Vector3d& place) const {
    double squared = kEnough * kEnough * spacing_ * spacing_;
    squared = std::min(squared, (place_[sphere] - place).squaredNorm());
    for (const std::size_t other : near_[sphere]) {
      squared = std::min(squared, (place_[other] - place).squaredNorm());
    }
    return std::sqrt(squared) / spacing_;
  }

  const Surface& surface_;
  const Eigen::Matrix3Xd& normal_;
  double spacing_;
  Eigen::Index outer_;
  std::size_t first_added_ = 0;
  std::vector<Vector3d> place_;                 ///< outer, inner, added
  std::vector<std::vector<std::size_t>> near_;  ///< of each outer sphere
};

}  // namespace

Positions support_below(const Surface& surface, const Positions& outer,
                        const Eigen::Matrix3Xd& normal, const Positions& inner, double spacing,
                        int wanted, std::size_t most) {
  const std::vector<int> inside = inside_of_outer(outer, inner, spacing);
  const auto lacks = [&](int found) { return found < wanted; };
  if (std::none_of(inside.begin(), inside.end(), lacks)) return Positions(3, 0);
  Below below(surface, outer, normal, inner, spacing);
  for (std::size_t i = 0; i < inside.size(); ++i) {
    while (below.inside(i) < wanted && below.added_count() < most && below.add_below(i)) {
    }
  }
  return below.added();
}

}  // namespace tpm::organ
