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

/// Throws Error(bad_input) that names number and place of outer spheres below kLeastOuterSupport,
/// unless there are none. Spheres that may not move along their normal are left out, and networks
/// of one layer, which have no inside.
void require_outer_support(const Network& network, const Constraints& constraints,
                           std::string_view where);

}  // namespace tpm::organ
