#include "tpm/organ/bonds/tool.hpp"

#include <cmath>
#include <limits>

namespace tpm::organ {
namespace {

/// Where a point lies as seen along a direction from another.
struct Offset {
  double along, across;
};

Offset offset(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
              const Eigen::Vector3d& direction) {
  const Eigen::Vector3d apart = to - from;
  const double along = apart.dot(direction);
  return {along, (apart - along * direction).norm()};
}

/// Distance before a sphere's centre, along its way, at which the tool touches it; none if it
/// passes by.
std::optional<double> standoff(const ToolShape& shape, double across, double radius) {
  if (shape.kind == ToolKind::punch) {
    return across <= shape.radius_m ? std::optional(radius) : std::nullopt;
  }
  const double reach = shape.radius_m + radius;
  return across < reach ? std::optional(std::sqrt(reach * reach - across * across)) : std::nullopt;
}

}  // namespace

Tool touching_tool(const ToolShape& shape, const Organ& organ, std::size_t aim,
                   const Eigen::Vector3d& direction) {
  const Eigen::Vector3d axis = organ.position.col(static_cast<Eigen::Index>(aim));
  double first = std::numeric_limits<double>::infinity();  // the aim itself is always met
  for (Eigen::Index i = 0; i < organ.position.cols(); ++i) {
    const auto [along, across] = offset(axis, organ.position.col(i), direction);
    if (const auto before = standoff(shape, across, organ.radius)) {
      first = std::min(first, along - *before);
    }
  }
  return {shape, direction, axis + first * direction};
}

std::vector<ToolContact> possible_contacts(const Tool& tool, std::uint32_t column,
                                           const Organ& organ, double stiffness_N_per_m) {
  const bool flat = tool.shape.kind == ToolKind::punch;
  const double reach = flat ? organ.radius : tool.shape.radius_m + organ.radius;
  const double width = flat ? tool.shape.radius_m : reach + organ.spacing;
  std::vector<ToolContact> contacts;
  for (Eigen::Index i = 0; i < organ.position.cols(); ++i) {
    if (offset(tool.position, organ.position.col(i), tool.direction).across > width) continue;
    contacts.push_back({static_cast<std::uint32_t>(i), column, reach, stiffness_N_per_m,
                        flat ? std::optional<Eigen::Vector3d>(-tool.direction) : std::nullopt});
  }
  return contacts;
}

double overlap_m(const Tool& tool, const Eigen::Vector3d& place, const Eigen::Vector3d& centre,
                 double radius) {
  if (tool.shape.kind == ToolKind::sphere) {
    return tool.shape.radius_m + radius - (centre - place).norm();
  }
  const auto [along, across] = offset(place, centre, tool.direction);
  if (across > tool.shape.radius_m) return -std::numeric_limits<double>::infinity();
  return radius - along;
}

}  // namespace tpm::organ
