#pragma once
#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "tpm/organ/body/surface.hpp"
#include "tpm/organ/body/triangle_mesh.hpp"

namespace tpm::organ {

/// The point of a triangle nearest to a given point.
struct TrianglePoint {
  int triangle = -1;
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();  ///< barycentric; exactly 0 off the interior
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double squared_distance = 0.0;  ///< m^2
};

/// A mesh in a hierarchy of bounding boxes, so that a query costs O(log n).
class TriangleTree {
 public:
  static constexpr double kAnywhere = std::numeric_limits<double>::infinity();

  /// @param mesh at least one triangle
  explicit TriangleTree(TriangleMesh mesh);

  [[nodiscard]] const TriangleMesh& mesh() const { return mesh_; }
  [[nodiscard]] const Eigen::AlignedBox3d& bounds() const { return bounds_; }
  /// @param within the caller's promise that the mesh comes nearer than this, m; it saves most of
  ///   the search and changes nothing. A promise that is not kept costs a second search.
  [[nodiscard]] TrianglePoint nearest(const Eigen::Vector3d& point,
                                      double within = kAnywhere) const;
  /// As nearest(), to the last bit, and faster if a triangle is near.
  /// @param triangle any number: beyond those of the mesh it saves nothing
  [[nodiscard]] TrianglePoint nearest_beside(const Eigen::Vector3d& point, double within,
                                             int triangle) const;
  /// As nearest(), to the last bit, and faster for a point that moves a little between one question
  /// and the next: the triangles near it are listed, and while it moves less than the list reaches
  /// they alone are asked.
  [[nodiscard]] TrianglePoint nearest_of_moved(const Eigen::Vector3d& point, double within,
                                               NearParts& near) const;
  /// The triangles whose bounding boxes meet a box, in rising order.
  [[nodiscard]] std::vector<int> meeting(const Eigen::AlignedBox3d& box) const;
  [[nodiscard]] Eigen::AlignedBox3d box_of(int triangle) const;

 private:
  /// A node of the tree of halves, of which three levels become one of eight children.
  struct Half {
    Eigen::AlignedBox3d box;
    int first = 0;  ///< first of order_ in a leaf, else the left child; the right one follows it
    int count = 0;  ///< triangles of a leaf; 0 in an inner node
  };
  static constexpr int kChildren = 8;
  using OfChildren = Eigen::Array<double, kChildren, 1>;
  /// A node with the boxes of its children, which one question is put to together.
  struct Node {
    std::array<OfChildren, 3> low, high;  ///< by coordinate; beyond the last child nothing is near
    std::array<int, kChildren> first{};   ///< as that of Half, of a leaf or the child's own node
    std::array<int, kChildren> count{};
  };
  /// Squares of the distances of a point from the boxes of the children.
  [[nodiscard]] static OfChildren squared_distances(const Node& node, const Eigen::Vector3d& point);
  /// A triangle as nearest() wants it, in the order of the leaves.
  struct Packed {
    Eigen::Vector3d a, b, c;
    Eigen::Vector3d normal;  ///< unit
    Eigen::Vector3d centre;  ///< of a ball around it
    double radius;           ///< of that ball, rounded up
  };
  /// @param below where the nodes below this one begin
  void split(std::vector<Half>& halves, int node, int below, int first, int count,
             const std::vector<Eigen::AlignedBox3d>& boxes);
  void pack(int first, int count);
  /// Among the listed triangles; none if one that is not listed, or rounding, might decide.
  /// @param sure triangles that are not listed are at least as far away, m
  [[nodiscard]] std::optional<TrianglePoint> nearest_listed(const Eigen::Vector3d& point,
                                                            double sure,
                                                            const NearParts& near) const;
  /// Lists the triangles near a point, unless they are many.
  /// @param moved since the last question, m
  void list(const Eigen::Vector3d& point, double moved, const TrianglePoint& nearest,
            NearParts& near) const;
  /// Adds the node of a half, whose children are at most three halvings below, and those below it.
  int join(const std::vector<Half>& halves, int half);

  TriangleMesh mesh_;
  std::vector<int> order_;
  std::vector<Packed> packed_;
  Eigen::AlignedBox3d bounds_;
  std::vector<Node> nodes_;
};

}  // namespace tpm::organ
