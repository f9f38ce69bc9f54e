#pragma once
#include <Eigen/Core>

#include "tpmkit/organ.hpp"

namespace tpm::organ {

/// Part of the surface that belongs to each sphere of the outer layer, m^2; 0 for others. The part
/// is the cell of the points that are nearest to the sphere, in its tangent plane, into which the
/// neighbours of the layer are unfolded at their distances; where there are none, at the rim of an
/// open sheet, it ends 0.8 spacings away. Neighbours on an opposite face do not count.
[[nodiscard]] Eigen::VectorXd outer_areas_m2(const Organ& organ);

}  // namespace tpm::organ
