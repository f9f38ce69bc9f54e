#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tpmkit/error.hpp"

namespace tpm::organ {

/// One column per sphere, m.
using Positions = Eigen::Matrix3Xd;

/// Positions of the spheres of an unloaded organ: geometry only, no stiffness.
///
/// Spheres are numbered from 1 in files and messages ("sphere 71", as the paper does) and from 0 in
/// memory. The numbering is part of the organ: it is the same on every run.
struct Organ {
  std::string name;                    ///< for titles and messages
  Positions position;                  ///< m
  Eigen::Matrix3Xd normal;             ///< outward unit normal of each sphere's layer
  std::vector<int> layer;              ///< 0: outermost
  double radius = 0.0;                 ///< of each sphere, m
  double spacing = 0.0;                ///< x, nominal distance between neighbours, m
  std::optional<std::size_t> contact;  ///< the sphere that the probe meets, if one is chosen
  std::vector<Remark> assumptions;     ///< of the shape ("coordinates are in metres")

  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(position.cols()); }
  [[nodiscard]] int layer_count() const;
};

/// Throws Error(bad_input) that names the first fault: sizes that differ, a coordinate that is not
/// finite, a normal that is not a unit vector, two spheres at one place, a layer without spheres,
/// a radius or spacing that is not above 0, a contact sphere that does not exist.
/// @param where for messages
void require_valid(const Organ& organ, std::string_view where);

/// The organ turned about the origin and then shifted: positions p become rotation * p + shift.
/// @param rotation a proper rotation
/// @param shift m
[[nodiscard]] Organ moved(Organ organ, const Eigen::Matrix3d& rotation,
                          const Eigen::Vector3d& shift);

/// Distances to the nearest other sphere of the organ, in units of its spacing, over the spheres
/// of one layer.
struct NearestDistances {
  std::size_t spheres = 0;
  double min = 0.0, mean = 0.0, max = 0.0;
};

/// One entry a layer, outermost first. The organ has at least two spheres.
[[nodiscard]] std::vector<NearestDistances> nearest_distances(const Organ& organ);

}  // namespace tpm::organ
