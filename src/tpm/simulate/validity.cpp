#include "tpm/simulate/validity.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tpm::organ {
namespace {

constexpr double kRounding_m = 1e-9;  // a depth of 12 mm that was asked for is not above 12 mm

void insert(std::vector<std::size_t>& rising, std::size_t sphere) {
  const auto at = std::lower_bound(rising.begin(), rising.end(), sphere);
  if (at == rising.end() || *at != sphere) rising.insert(at, sphere);
}

/// What no bond that has turned beyond an angle stays below; 0 where the tangent says nothing.
double cautious_tangent(double angle_rad) {
  constexpr double kAlmost = 1.0 - 1e-9;
  return angle_rad > 1.0 ? 0.0 : kAlmost * std::tan(angle_rad);
}

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

ValidityWatch::ValidityWatch(const Network& network, const Probe& probe, bool depth_limits)
    : network_(network), probe_(probe), depth_limits_(depth_limits) {}

double ValidityWatch::indentation_m(Eigen::Index sphere, const Positions& position) const {
  return (position.col(sphere) - network_.organ.position.col(sphere)).dot(probe_.direction);
}

std::vector<std::int32_t> ValidityWatch::flags(const Positions& position) const {
  double most_turned_rad = kValidTurning_rad;
  return flags(position, most_turned_rad);
}

std::vector<std::int32_t> ValidityWatch::flags(const Positions& position,
                                               double& most_turned_rad) const {
  std::vector<std::int32_t> flags(network_.organ.size(), 0);
  for (std::size_t i = 0; depth_limits_ && i < flags.size(); ++i) {
    const double indentation = indentation_m(static_cast<Eigen::Index>(i), position);
    if (indentation > kValidIndentation_m + kRounding_m) flags[i] |= 1;
    if (indentation > kDamageIndentation_m + kRounding_m) flags[i] |= 2;
  }
  const Positions& rest = network_.organ.position;
  double tangent = cautious_tangent(std::min(most_turned_rad, kValidTurning_rad));
  for (const Bond& bond : network_.bonds) {
    if (bond.kind != BondKind::lateral) continue;
    const Eigen::Vector3d before = rest.col(bond.b) - rest.col(bond.a);
    const Eigen::Vector3d now = position.col(bond.b) - position.col(bond.a);
    const double along = before.dot(now);
    const double across = tangent * along;
    const double turning = before.cross(now).squaredNorm();
    if (along > 0.0 && turning < across * across) continue;  // without the cost of an angle
    const double turned_rad = std::atan2(std::sqrt(turning), along);
    if (turned_rad > kValidTurning_rad) {
      flags[bond.a] |= 4;
      flags[bond.b] |= 4;
    }
    if (!(turned_rad > most_turned_rad)) continue;
    most_turned_rad = turned_rad;
    tangent = cautious_tangent(std::min(most_turned_rad, kValidTurning_rad));
  }
  return flags;
}

void ValidityWatch::see(double time_s, const Positions& position) {
  const std::vector<std::int32_t> now = flags(position, seen_.most_turned_rad);
  for (std::size_t i = 0; i < now.size(); ++i) {
    seen_.deepest_m =
        std::max(seen_.deepest_m, indentation_m(static_cast<Eigen::Index>(i), position));
    for (std::size_t k = 0; k < kValidityLimits; ++k) {
      if ((now[i] & (1 << k)) == 0) continue;
      ValidityBreach& breach = seen_.breach[k];
      if (!breach.first_time_s) breach.first_time_s = time_s;
      insert(breach.spheres, i);
    }
  }
}

}  // namespace tpm::organ
