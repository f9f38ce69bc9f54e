#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "tpm/organ/body/triangle_mesh.hpp"

namespace tpm::organ {

/// The triangles of a mesh file as they stand there, without its unit, and what of the file was not
/// needed.
struct MeshContents {
  TriangleMesh mesh;
  std::vector<Remark> notes;
};

/// Reads STL, binary or text: text begins with "solid" in any case and holds no control characters,
/// for the header of a binary file may begin with that word too. All solids of a text form one
/// surface; a last one without "endsolid" and bytes behind the last triangle become notes. Normals
/// are not read. Throws Error(bad_input) that names the line or byte for a file that is cut off, a
/// facet that is no triangle, a coordinate that is no finite number, and for no triangles.
/// @param where the file, for messages
[[nodiscard]] MeshContents parse_stl(std::string_view bytes, std::string_view where);

}  // namespace tpm::organ
