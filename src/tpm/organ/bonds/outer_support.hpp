#pragma once
#include <string_view>
#include <vector>

#include "tpm/organ/bonds/constraints.hpp"
#include "tpm/organ/bonds/network.hpp"

namespace tpm::organ {

/// Least stiffness along its normal that the inside gives an outer sphere, in parts of the target:
/// that of the partner of the star, which the rule `normalised` gives a sphere.
inline constexpr double kLeastOuterSupport = 0.2;

/// Support of each sphere of the outer layer against a push along its normal, its neighbours
/// fixed, in parts of the target: the sum of factor times cos^2 (angle to its normal) over its
/// bonds to spheres that lie inside, or whose normal differs by 30 degrees or more (the other face
/// of an edge). An absolute measure: a sphere that hardly anything holds is found however little
/// its neighbours hold each other. One entry a sphere of layer 0, by number.
[[nodiscard]] std::vector<double> outer_support(const Network& network);

/// Least stiffness that the bonds of a sphere give it in any direction in which it may move, in the
/// same parts. Fillings of balls, plates and tubes have 0.4 and more, the tip of a thin spike 0.
inline constexpr double kLeastHold = 0.02;

/// Stiffness of each sphere in the direction in which its bonds hold it least, its neighbours
/// fixed, in parts of the target: the least eigenvalue of the sum of factor times n n^T over its
/// bonds, on the coordinates that are free. 1 for a fixed sphere. Unlike outer_support it finds a
/// sphere that is held along its normal but not sideways.
[[nodiscard]] std::vector<double> least_hold(const Network& network,
                                             const Constraints& constraints);

/// Throws Error(bad_input) that names number and place of spheres below kLeastHold, unless there
/// are none. Networks of one layer are left out: nothing but their curvature holds them.
void require_hold(const Network& network, const Constraints& constraints, std::string_view where);

/// Throws Error(bad_input) that names number and place of outer spheres below kLeastOuterSupport,
/// unless there are none. Spheres that may not move along their normal are left out, and networks
/// of one layer, which have no inside.
void require_outer_support(const Network& network, const Constraints& constraints,
                           std::string_view where);

}  // namespace tpm::organ
