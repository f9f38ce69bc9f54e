#pragma once
#include <cstddef>

#include "tpm/organ/body/surface.hpp"
#include "tpmkit/organ.hpp"

namespace tpm::organ {

/// Reach of a landing site around its sphere, in spacings: the default support of a network.
inline constexpr double kLandingReach = 1.5;

/// Where a probe lands on the outer layer.
struct LandingSite {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< outward, at the contact sphere
  bool flat = false;  ///< the contact sphere and its neighbours lie in one plane
};

/// Moves a sphere of the outer layer and its neighbours, along the normal of the surface at the
/// sphere, into the one plane square to that normal that moves them least (their mean height). Then
/// the lateral bonds of the sphere are square to its normal and do not resist a small indentation,
/// as in the star (docs/theory.md). Neighbours are those within kLandingReach spacings of it
/// in the plane whose normal is less than 90 degrees off its own: the other face of a thin body
/// stays where it is. Nothing moves if one of them would have to by more than a quarter of a
/// spacing: the organ is too small for its spheres to have a flat site.
/// @param outer places of the outer layer, on the surface, m
[[nodiscard]] LandingSite flatten_landing_site(const Surface& surface, Positions& outer,
                                               std::size_t sphere, double spacing);

}  // namespace tpm::organ
