#pragma once
#include <cstddef>
#include <vector>

#include "tpm/organ/body/surface.hpp"

namespace tpm::organ {

/// Inner spheres within reach that every outer sphere of a solid filling should have: three bonds
/// hold a sphere against a push from any side.
inline constexpr int kWantedInside = 3;
/// Reach of a bond in spacings: the default support of a network.
inline constexpr double kSolidReach = 1.5;

/// Places to add below the outer spheres that have fewer than `wanted` inner spheres within reach:
/// a lattice of which a plane lies just too deep, or an edge, leaves such spheres with nothing to
/// hold them. A place lies 0.7 to 1 spacing below its sphere, upright or aslant, at least 0.7
/// spacings from the surface but near an edge (0.5), and at least 0.62 spacings from every other
/// sphere. Of those the place farthest from others is taken. Where there is none the sphere keeps
/// what it has; the network says whether it stands (outer_support.hpp).
/// @param outer places on the surface, m
/// @param normal of the outer spheres, outward
/// @param inner the others, m
/// @param most as many are added at most
[[nodiscard]] Positions support_below(const Surface& surface, const Positions& outer,
                                      const Eigen::Matrix3Xd& normal, const Positions& inner,
                                      double spacing, int wanted, std::size_t most);

}  // namespace tpm::organ
