#pragma once
#include <filesystem>

#include "tpm/organ/body/triangle_mesh.hpp"
#include "tpmkit/units.hpp"

namespace tpm::organ {

/// Reads a closed surface from an STL (text or binary) or OBJ file; polygons are cut into
/// triangles, and all objects of the file make one surface. Throws Error(bad_input) for another
/// ending, a file that is missing, empty or damaged, and for every fault that closed_mesh() names.
/// @param unit the length that a coordinate of 1 means; neither format says it
[[nodiscard]] ClosedMesh read_closed_mesh(const std::filesystem::path& path, const Unit& unit);

}  // namespace tpm::organ
