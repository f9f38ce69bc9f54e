#include "tpm/organ/run/validity.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tpm/organ/scene/experiment_scene.hpp"

namespace tpm::organ {
namespace {

constexpr double kRounding_m = 1e-9;  // a depth of 12 mm that was asked for is not above 12 mm

void insert(std::vector<std::size_t>& rising, std::size_t sphere) {
  const auto at = std::lower_bound(rising.begin(), rising.end(), sphere);
  if (at == rising.end() || *at != sphere) rising.insert(at, sphere);
}

/// Lower bounds for a bond that has turned beyond an angle; 0 where there is none.
struct CautiousAngle {
  explicit CautiousAngle(double angle_rad) {
    constexpr double kAlmost = 1.0 - 1e-9;
    if (angle_rad > 1.0) return;
    sine = kAlmost * std::sin(angle_rad);
    tangent = kAlmost * std::tan(angle_rad);
  }
  double sine = 0.0;     ///< of what its ends have moved apart, over its length at rest
  double tangent = 0.0;  ///< of the tangent of its angle
};

}  // namespace

std::string_view key_of(ValidityLimit limit) {
  switch (limit) {
    case ValidityLimit::indentation:
      return "indentation_over_10_mm";
    case ValidityLimit::damage:
      return "indentation_over_12_mm";
    case ValidityLimit::turning:
      break;
  }
  return "lateral_bond_turned_over_30_degrees";
}

std::string_view words_of(ValidityLimit limit) {
  switch (limit) {
    case ValidityLimit::indentation:
      return "indented by more than 10 mm, where the paper's validity ends";
    case ValidityLimit::damage:
      return "indented by more than 12 mm, where liver is damaged";
    case ValidityLimit::turning:
      break;
  }
  return "a lateral bond turned by more than 30 degrees, beyond the model's range";
}

bool Validity::whole() const {
  return std::none_of(breach.begin(), breach.end(),
                      [](const ValidityBreach& b) { return b.first_time_s.has_value(); });
}

bool depth_limits_apply(const Tissue& tissue) {
  constexpr double kPaperWidth_m = 0.21, kAlike = 1.5;  // no narrower or wider by more than this
  if (tissue.star) return true;
  if (!tissue.liver) return false;
  const Eigen::RowVectorXd across = tissue.network.organ.position.row(0);
  const double width_m = across.maxCoeff() - across.minCoeff();
  return width_m * kAlike > kPaperWidth_m && width_m < kAlike * kPaperWidth_m;
}

ValidityWatch::ValidityWatch(const ExperimentScene& scene)
    : rest_(scene.tissue.network.organ.position),
      direction_(scene.probe().direction),
      depth_limits_(depth_limits_apply(scene.tissue)) {
  for (const Bond& bond : scene.tissue.network.bonds) {
    if (bond.kind != BondKind::lateral) continue;
    lateral_.push_back({bond.a, bond.b, (rest_.col(bond.b) - rest_.col(bond.a)).norm()});
  }
}

std::vector<std::int32_t> ValidityWatch::flags(const Positions& position) const {
  double deepest_m = 0.0, most_turned_rad = kValidTurning_rad;
  return flags(position, deepest_m, most_turned_rad);
}

std::vector<std::int32_t> ValidityWatch::flags(const Positions& position, double& deepest_m,
                                               double& most_turned_rad) const {
  const Eigen::Matrix3Xd moved = position - rest_;
  std::vector<std::int32_t> flags(static_cast<std::size_t>(rest_.cols()), 0);
  const Eigen::RowVectorXd indentation = direction_.transpose() * moved;
  deepest_m = std::max(deepest_m, indentation.maxCoeff());
  for (std::size_t i = 0; depth_limits_ && i < flags.size(); ++i) {
    const double here = indentation[static_cast<Eigen::Index>(i)];
    if (here > kValidIndentation_m + kRounding_m) flags[i] |= 1;
    if (here > kDamageIndentation_m + kRounding_m) flags[i] |= 2;
  }
  const Eigen::RowVectorXd distance = moved.colwise().norm();
  CautiousAngle below(std::min(most_turned_rad, kValidTurning_rad));
  for (const auto& [first, second, length_m] : lateral_) {
    const auto a = static_cast<Eigen::Index>(first), b = static_cast<Eigen::Index>(second);
    // Without the cost of an angle, where its ends have moved or it has turned too little.
    if (distance[a] + distance[b] < below.sine * length_m) continue;
    const Eigen::Vector3d before = rest_.col(b) - rest_.col(a);
    const Eigen::Vector3d now = position.col(b) - position.col(a);
    const double along = before.dot(now);
    const double across = below.tangent * along;
    const double turning = before.cross(now).squaredNorm();
    if (along > 0.0 && turning < across * across) continue;
    const double turned_rad = std::atan2(std::sqrt(turning), along);
    if (turned_rad > kValidTurning_rad) {
      flags[first] |= 4;
      flags[second] |= 4;
    }
    if (!(turned_rad > most_turned_rad)) continue;
    most_turned_rad = turned_rad;
    below = CautiousAngle(std::min(most_turned_rad, kValidTurning_rad));
  }
  return flags;
}

void ValidityWatch::see(double time_s, const Positions& position) {
  const std::vector<std::int32_t> now = flags(position, seen_.deepest_m, seen_.most_turned_rad);
  for (std::size_t i = 0; i < now.size(); ++i) {
    for (std::size_t k = 0; k < kValidityLimits; ++k) {
      if ((now[i] & (1 << k)) == 0) continue;
      ValidityBreach& breach = seen_.breach[k];
      if (!breach.first_time_s) breach.first_time_s = time_s;
      insert(breach.spheres, i);
    }
  }
}

}  // namespace tpm::organ
