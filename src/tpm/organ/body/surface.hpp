#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>

#include "tpmkit/organ.hpp"

namespace tpm::organ {

/// A point of a surface and the outward unit normal there.
struct SurfacePoint {
  Eigen::Vector3d position;  ///< m
  Eigen::Vector3d normal;
};

/// The parts of a surface near a place, which Surface::nearest_of_moved keeps from one question to
/// the next. Before the first question none are known.
struct NearParts {
  static constexpr std::size_t kMost = 16;
  int part = -1;  ///< on which the last answer lies, as the surface numbers them
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< where the parts were listed
  double reach = 0.0;  ///< all parts that come nearer to the place than this are listed, m
  std::size_t count = 0;
  std::array<int, kMost> listed{};
};

/// A closed surface that bounds one body: what a filling asks of a shape, by several threads at
/// once. All lengths in m.
class Surface {
 public:
  Surface() = default;
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;
  Surface(Surface&&) = default;
  Surface& operator=(Surface&&) = default;
  virtual ~Surface() = default;

  /// The point of the surface nearest to a point.
  [[nodiscard]] virtual SurfacePoint nearest(const Eigen::Vector3d& point) const = 0;
  /// The same place, found faster if the surface comes nearer than `within`, m, as the caller
  /// knows.
  [[nodiscard]] virtual Eigen::Vector3d nearest_position(const Eigen::Vector3d& point,
                                                         double within) const = 0;
  /// The same place of a point that moves a little between one question and the next, found faster
  /// among the parts near the answer before.
  /// @param near of this point alone
  [[nodiscard]] virtual Eigen::Vector3d nearest_of_moved(const Eigen::Vector3d& point,
                                                         double within, NearParts& near) const {
    (void)near;
    return nearest_position(point, within);
  }
  /// Distance to the surface, negative inside.
  [[nodiscard]] virtual double signed_distance(const Eigen::Vector3d& point) const = 0;
  /// `count` points spread over the surface in proportion to area, the same for the same seed.
  [[nodiscard]] virtual Positions spread(std::size_t count, std::uint64_t seed) const = 0;
  [[nodiscard]] virtual Eigen::AlignedBox3d bounds() const = 0;
  [[nodiscard]] virtual double area() const = 0;    ///< m^2
  [[nodiscard]] virtual double volume() const = 0;  ///< m^3
};

}  // namespace tpm::organ
