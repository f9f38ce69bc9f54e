#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/organ.hpp"

namespace tpm::organ {

/// Triangles over numbered vertices; seen from outside, the corners run counter-clockwise.
struct TriangleMesh {
  Positions vertices;          ///< m
  Eigen::Matrix3Xi triangles;  ///< one column of three vertex indices per triangle

  [[nodiscard]] Eigen::Vector3d corner(Eigen::Index triangle, Eigen::Index which) const {
    return vertices.col(triangles(which, triangle));
  }
  /// Half the cross product of two edges: area times outward normal.
  [[nodiscard]] Eigen::Vector3d area_vector(Eigen::Index triangle) const;
};

/// Sum of the triangles, m^2.
[[nodiscard]] double mesh_area(const TriangleMesh& mesh);
/// Volume inside a closed mesh, m^3; negative where the triangles face inwards.
[[nodiscard]] double mesh_volume(const TriangleMesh& mesh);

/// A mesh that bounds one body, and what had to be done to it.
struct ClosedMesh {
  TriangleMesh mesh;
  std::vector<Remark> notes;
};

/// Joins vertices closer than 1e-7 of the mesh's size, drops triangles that vanish by that, turns a
/// mesh that faces inwards, and checks the rest. Throws Error(bad_input) that names the first fault
/// and its place (numbers of triangles from 1 in the order given, coordinates in m): a vertex that
/// is not finite, a triangle without area, an edge of one triangle (open) or of more than two, two
/// triangles that wind differently, more than one piece, no volume, triangles that cut each other.
/// @param where for messages, usually the file
[[nodiscard]] ClosedMesh closed_mesh(const TriangleMesh& mesh, std::string_view where);

/// The triangles of a mesh that cut or touch each other elsewhere than at shared corners: the first
/// such pair in the order of the triangles, or (-1, -1).
[[nodiscard]] Eigen::Vector2i first_crossing(const TriangleMesh& mesh);

}  // namespace tpm::organ
