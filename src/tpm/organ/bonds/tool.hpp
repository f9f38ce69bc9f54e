#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "tpmkit/organ.hpp"

namespace tpm::organ {

enum class ToolKind {
  sphere,  ///< a ball
  punch,   ///< a cylinder with a flat face, square to its direction
};

/// A rigid body without friction that pushes spheres away and does not hold them.
struct ToolShape {
  ToolKind kind = ToolKind::sphere;
  double radius_m = 0.002;  ///< > 0
};

/// A tool where it first touches an organ at rest.
struct Tool {
  ToolShape shape;
  Eigen::Vector3d direction;  ///< unit vector, into the tissue
  Eigen::Vector3d position;   ///< of the ball's centre, or of the middle of the face, m
};

/// A pair of a sphere and a tool that may touch.
struct ToolContact {
  std::uint32_t sphere = 0, tool = 0;  ///< columns of positions
  /// Distance at which they touch: of their centres, or along the normal, m.
  double reach_m = 0.0;
  double stiffness_N_per_m = 0.0;                        ///< of the overlap, > 0
  std::optional<Eigen::Vector3d> normal = std::nullopt;  ///< of a flat face, from sphere to tool
};

/// The tool moved along its direction towards an organ at rest until it touches its first sphere.
/// @param aim a sphere of the organ that lies on the tool's axis, from 0
/// @param direction unit vector
[[nodiscard]] Tool touching_tool(const ToolShape& shape, const Organ& organ, std::size_t aim,
                                 const Eigen::Vector3d& direction);

/// The spheres that a tool may come to touch. A punch meets those whose centres lie under its face
/// when at rest; a ball those within a spacing of the cylinder that it sweeps.
/// @param column of the tool in positions
/// @param stiffness_N_per_m of each contact, > 0
[[nodiscard]] std::vector<ToolContact> possible_contacts(const Tool& tool, std::uint32_t column,
                                                         const Organ& organ,
                                                         double stiffness_N_per_m);

/// Gap between a sphere and a tool, m; negative where they overlap.
/// @param sphere, tool where their centres are, or the middle of the tool's face, m
[[nodiscard]] inline double contact_gap_m(const ToolContact& contact, const Eigen::Vector3d& sphere,
                                          const Eigen::Vector3d& tool) {
  const Eigen::Vector3d apart = tool - sphere;
  return (contact.normal ? apart.dot(*contact.normal) : apart.norm()) - contact.reach_m;
}

/// Depth of the tool in a sphere, m; negative where there is a gap. A punch is as long
/// as needed and acts on what lies under its face.
/// @param place of the tool now, m
/// @param centre of the sphere now, m
/// @param radius of the sphere, m
[[nodiscard]] double overlap_m(const Tool& tool, const Eigen::Vector3d& place,
                               const Eigen::Vector3d& centre, double radius);

}  // namespace tpm::organ
