#pragma once
#include <string_view>

#include "tpm/organ/body/stl_file.hpp"

namespace tpm::organ {

/// A polygon is cut into triangles at a cost that grows with the cube of its corners.
inline constexpr std::size_t kMostPolygonCorners = 1000;

/// Reads the vertices (v) and faces (f) of an OBJ text: corners as v, v/vt, v//vn or v/vt/vn,
/// counted from 1, or from the last vertex on if negative; polygons are cut into triangles; "\" at
/// the end of a line continues it, "#" begins a comment, a byte order mark may stand in front. All
/// faces form one surface, whatever their object, group and material. Other statements are passed
/// over: no other file is opened, and a surface that they hold would be missed as an open one.
/// Throws Error(bad_input) that names the line for a vertex that has not three finite coordinates,
/// a face that names no vertex or has more than kMostPolygonCorners, and for no faces.
/// @param where the file, for messages
[[nodiscard]] MeshContents parse_obj(std::string_view bytes, std::string_view where);

}  // namespace tpm::organ
