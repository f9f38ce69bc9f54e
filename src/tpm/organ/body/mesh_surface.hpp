#pragma once
#include <span>
#include <vector>

#include "tpm/organ/body/surface.hpp"
#include "tpm/organ/body/triangle_tree.hpp"

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
  [[nodiscard]] Eigen::Vector3d nearest_of_moved(const Eigen::Vector3d& point, double within,
                                                 NearParts& near) const override;
  [[nodiscard]] double signed_distance(const Eigen::Vector3d& point) const override;
  [[nodiscard]] Positions spread(std::size_t count, std::uint64_t seed) const override;
  [[nodiscard]] Eigen::AlignedBox3d bounds() const override { return tree_.bounds(); }
  [[nodiscard]] double area() const override { return area_; }
  [[nodiscard]] double volume() const override { return volume_; }
  [[nodiscard]] const TriangleMesh& mesh() const { return tree_.mesh(); }

 private:
  /// A corner of a triangle.
  struct Corner {
    int triangle = 0, which = 0;
  };
  // Normals are found where they are asked for: most triangles of a mesh are nobody's nearest.
  /// The corners that meet at a vertex, in the order of the triangles.
  [[nodiscard]] std::span<const Corner> fan(int vertex) const;
  [[nodiscard]] int vertex_of(const Corner& at) const {
    return mesh().triangles(at.which, at.triangle);
  }
  /// Of a triangle, unit.
  [[nodiscard]] Eigen::Vector3d face(int triangle) const;
  /// Angle of a triangle at a corner, rad.
  [[nodiscard]] double angle(const Corner& at) const;
  /// The triangle beyond the edge from a corner to the next one.
  [[nodiscard]] int beyond(const Corner& edge) const;
  /// True if that triangle meets its own at 30 degrees or more.
  [[nodiscard]] bool is_crease(const Corner& edge) const;
  [[nodiscard]] bool on_crease(int vertex) const;
  /// The mean of the faces at a corner, weighed by angle.
  /// @param smooth without those at 30 degrees or more to the corner's own
  [[nodiscard]] Eigen::Vector3d mean_normal(const Corner& at, bool smooth) const;
  [[nodiscard]] Eigen::Vector3d pseudonormal(const TrianglePoint& at) const;
  [[nodiscard]] Eigen::Vector3d normal(const TrianglePoint& at) const;

  TriangleTree tree_;
  std::vector<std::size_t> fan_end_;  ///< of the vertex before
  std::vector<Corner> fans_;
  double area_ = 0.0;
  double volume_ = 0.0;
};

}  // namespace tpm::organ
