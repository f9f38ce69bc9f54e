#pragma once
#include <vector>

#include "tpm/network/surface.hpp"
#include "tpm/network/triangle_tree.hpp"

namespace tpm::organ {

/// The surface of a closed mesh. Normals are interpolated between the corners of a triangle where
/// neighbouring triangles meet at less than 30 degrees, and keep the crease where they do not;
/// on a crease they are the mean over the triangles that meet there, weighted by angle.
class MeshSurface final : public Surface {
 public:
  /// @param mesh closed and facing outwards (closed_mesh() checks that)
  explicit MeshSurface(TriangleMesh mesh);

  [[nodiscard]] SurfacePoint nearest(const Eigen::Vector3d& point) const override;
  [[nodiscard]] Eigen::Vector3d nearest_position(const Eigen::Vector3d& point,
                                                 double within) const override;
  [[nodiscard]] double signed_distance(const Eigen::Vector3d& point) const override;
  [[nodiscard]] Positions spread(std::size_t count, std::uint64_t seed) const override;
  [[nodiscard]] Eigen::AlignedBox3d bounds() const override { return tree_.bounds(); }
  [[nodiscard]] double area() const override { return area_; }
  [[nodiscard]] double volume() const override { return volume_; }
  [[nodiscard]] const TriangleMesh& mesh() const { return tree_.mesh(); }

 private:
  /// Of one triangle: the normals that its interior, its edges and its corners have.
  struct Normals {
    Eigen::Vector3d face;
    Eigen::Matrix3d smooth;                  ///< one column a corner, to be interpolated
    Eigen::Matrix3d edge;                    ///< column i: the edge from corner i to corner i + 1
    bool crease[3] = {false, false, false};  ///< of each edge
  };
  /// @param angles one column a triangle, at its corners, rad
  void set_corner_normals(const Eigen::Matrix3Xd& angles);
  void set_edge_normals();
  [[nodiscard]] Eigen::Vector3d pseudonormal(const TrianglePoint& at) const;
  [[nodiscard]] Eigen::Vector3d normal(const TrianglePoint& at) const;

  TriangleTree tree_;
  std::vector<Normals> normals_;
  Eigen::Matrix3Xd vertex_normals_;
  std::vector<bool> on_crease_;  ///< of each vertex
  double area_ = 0.0;
  double volume_ = 0.0;
};

}  // namespace tpm::organ
