#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tpm/organ/body/surface.hpp"

namespace tpm::organ {

/// Inner spheres within reach that every outer sphere of a solid filling should have: three bonds
/// hold a sphere against a push from any side.
inline constexpr int kWantedInside = 3;
/// Reach of a bond in spacings: the default support of a network.
inline constexpr double kSolidReach = 1.5;
/// Least steadiness of an outer sphere.
inline constexpr double kLeastSteadiness = 0.4;

/// Stiffness of the inner bonds along the normal of an outer sphere that is free to slide, over
/// that of one that is not, 0 to 1: 1 - c^T (K + s I)^-1 c with the tangential stiffness K and the
/// coupling c of the inner bonds over their normal stiffness, and s = 1/4 for its six neighbours on
/// the surface, which slide too. 1 if inner spheres lie evenly around the normal; little if all lie
/// to one side, so that a push is answered by a slide. 0 without inner spheres.
/// @param inner from the sphere to those within reach, m
[[nodiscard]] double steadiness(const Eigen::Vector3d& normal,
                                std::span<const Eigen::Vector3d> inner);

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

/// Places to add below the outer spheres that inner ones hold from one side alone: of the places of
/// support_below, the one that makes the sphere steadiest. Outer spheres without any inner one are
/// not asked for.
[[nodiscard]] Positions steadying_below(const Surface& surface, const Positions& outer,
                                        const Eigen::Matrix3Xd& normal, const Positions& inner,
                                        double spacing);

}  // namespace tpm::organ
