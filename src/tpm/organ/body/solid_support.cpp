#include "tpm/organ/body/solid_support.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "tpm/organ/body/neighbours.hpp"

namespace tpm::organ {
namespace {

using Eigen::Vector3d;

constexpr double kApart = 0.62;  // least distance of an added sphere from all others, in spacings
constexpr double kEnough = 0.8;  // farther from the others than this is no better
constexpr double kLeastDistance = 0.5;  // of an added sphere to the surface, in spacings
constexpr std::array<double, 4> kDepths{0.8, 0.9, 0.7, 1.0};  // below its sphere, the best first
constexpr std::array<double, 3> kAslant{0.0, 0.3, 0.6};       // beside it
constexpr int kTurns = 8;

/// From each outer sphere to the inner ones within reach, m.
std::vector<std::vector<Vector3d>> inside_of_outer(const Positions& outer, const Positions& inner,
                                                   double spacing) {
  Positions all(3, outer.cols() + inner.cols());
  all << outer, inner;
  const auto count = static_cast<std::size_t>(outer.cols());
  std::vector<std::vector<Vector3d>> inside(count);
  for (const NeighbourPair& pair : pairs_within(all, kSolidReach * spacing)) {
    if (pair.first >= count || pair.second < count) continue;
    inside[pair.first].emplace_back(all.col(static_cast<Eigen::Index>(pair.second)) -
                                    all.col(static_cast<Eigen::Index>(pair.first)));
  }
  return inside;
}

bool is_unsteady(const Vector3d& normal, std::span<const Vector3d> inner) {
  return !inner.empty() && steadiness(normal, inner) < kLeastSteadiness;
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

  /// From a sphere to the inner ones within reach, m.
  [[nodiscard]] std::vector<Vector3d> inside(std::size_t sphere) const {
    std::vector<Vector3d> found;
    for (const std::size_t other : near_[sphere]) {
      const Vector3d apart = place_[other] - place_[sphere];
      if (!is_outer(other) && apart.norm() <= kSolidReach * spacing_) found.push_back(apart);
    }
    return found;
  }

  /// True if there was a place.
  bool add_below(std::size_t sphere) {
    return add(sphere,
               best_below(sphere, [](const Vector3d&, double distance) { return distance; }));
  }

  /// True if there was a place that makes the sphere steadier.
  bool steady(std::size_t sphere) {
    const Vector3d normal = normal_.col(static_cast<Eigen::Index>(sphere));
    std::vector<Vector3d> inner = inside(sphere);
    const double before = steadiness(normal, inner);
    inner.emplace_back();
    const auto with = [&](const Vector3d& place, double) {
      inner.back() = place - place_[sphere];
      return steadiness(normal, inner);
    };
    const std::optional<Vector3d> place = best_below(sphere, with);
    if (!place || with(*place, 0.0) <= before) return false;
    return add(sphere, place);
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

  bool add(std::size_t sphere, const std::optional<Vector3d>& place) {
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

  /// The free place of the largest value.
  /// @param value of a place and its distance to the others in spacings
  template <class Value>
  [[nodiscard]] std::optional<Vector3d> best_below(std::size_t sphere, const Value& value) const {
    const Vector3d inward = -normal_.col(static_cast<Eigen::Index>(sphere));
    const Vector3d side = inward.unitOrthogonal();
    const Vector3d across = inward.cross(side);
    std::optional<Vector3d> best;
    double largest = 0.0;
    for (const double aslant : kAslant) {
      for (const double depth : kDepths) {
        for (int turn = 0; turn < (aslant > 0.0 ? kTurns : 1); ++turn) {
          const double angle = 2.0 * std::numbers::pi * turn / kTurns;
          const Vector3d place =
              place_[sphere] + spacing_ * (depth * inward + aslant * (std::cos(angle) * side +
                                                                      std::sin(angle) * across));
          const double distance = distance_to_others(sphere, place);
          if (distance <= kApart * (1.0 + 1e-9)) continue;
          const double found = value(place, distance);
          if (found <= largest * (1.0 + 1e-9)) continue;  // a later one must be better
          if (-surface_.signed_distance(place) < kLeastDistance * spacing_) continue;
          largest = found;
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

double steadiness(const Eigen::Vector3d& normal, std::span<const Eigen::Vector3d> inner) {
  constexpr double kBeside = 0.25;
  if (inner.empty()) return 0.0;
  const Vector3d side = normal.unitOrthogonal();
  Eigen::Matrix<double, 2, 3> tangential;
  tangential << side.transpose(), normal.cross(side).transpose();
  double along = 0.0;
  Eigen::Matrix2d sideways = Eigen::Matrix2d::Zero();
  Eigen::Vector2d coupling = Eigen::Vector2d::Zero();
  for (const Vector3d& apart : inner) {
    const Vector3d direction = apart.normalized();
    const double cosine = direction.dot(normal);
    const Eigen::Vector2d slant = tangential * direction;
    along += cosine * cosine;
    sideways += slant * slant.transpose();
    coupling += cosine * slant;
  }
  if (along == 0.0) return 0.0;
  const Eigen::Matrix2d held = sideways / along + kBeside * Eigen::Matrix2d::Identity();
  return 1.0 - coupling.dot(held.inverse() * coupling) / (along * along);
}

Positions support_below(const Surface& surface, const Positions& outer,
                        const Eigen::Matrix3Xd& normal, const Positions& inner, double spacing,
                        int wanted, std::size_t most) {
  const std::vector<std::vector<Vector3d>> inside = inside_of_outer(outer, inner, spacing);
  const auto lacks = [&](const std::vector<Vector3d>& found) {
    return found.size() < static_cast<std::size_t>(wanted);
  };
  if (std::none_of(inside.begin(), inside.end(), lacks)) return Positions(3, 0);
  Below below(surface, outer, normal, inner, spacing);
  for (std::size_t i = 0; i < inside.size(); ++i) {
    while (lacks(below.inside(i)) && below.added_count() < most && below.add_below(i)) {
    }
  }
  return below.added();
}

Positions steadying_below(const Surface& surface, const Positions& outer,
                          const Eigen::Matrix3Xd& normal, const Positions& inner, double spacing) {
  const std::vector<std::vector<Vector3d>> inside = inside_of_outer(outer, inner, spacing);
  std::vector<std::size_t> unsteady;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (is_unsteady(normal.col(static_cast<Eigen::Index>(i)), inside[i])) unsteady.push_back(i);
  }
  if (unsteady.empty()) return Positions(3, 0);
  Below below(surface, outer, normal, inner, spacing);
  for (const std::size_t i : unsteady) {
    const Vector3d own = normal.col(static_cast<Eigen::Index>(i));
    while (is_unsteady(own, below.inside(i)) && below.steady(i)) {
    }
  }
  return below.added();
}

}  // namespace tpm::organ
