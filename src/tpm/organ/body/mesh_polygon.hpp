#pragma once
#include <span>
#include <vector>

#include "tpm/organ/body/mesh_coordinate.hpp"

namespace tpm::organ {

/// Three corners of a polygon, by their places in it.
using PolygonTriangle = std::array<int, 3>;

/// Cuts a flat simple polygon of three or more corners into triangles that wind as it does: four
/// corners from the concave one on, more corners ear by ear (Meisters 1975), seen along the axis
/// that is nearest to its normal. Costs the cube of the corners at worst. Corners on a line are cut
/// so that every triangle has area, where that is possible. Empty if no ear is found: then the
/// polygon crosses itself. Of one that does and is cut all the same, triangles cut each other.
[[nodiscard]] std::vector<PolygonTriangle> cut_polygon(std::span<const MeshCorner> corners);

}  // namespace tpm::organ
