#include "tpm/organ/body/mesh_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"
#include "tpm/organ/body/obj_file.hpp"
#include "tpm/organ/body/stl_file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

/// ".stl" or ".obj". Other formats are refused.
std::string format_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](char letter) {
    return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
  });
  if (ending == ".stl" || ending == ".obj") return ending;
  throw bad_input(path.string(),
                  fmt::format("the ending '{}' is no known format", printable(ending)),
                  "a closed surface in .stl or .obj");
}

void require_no_utf16(const std::string& bytes, const std::string& file) {
  if (!bytes.starts_with("\xFF\xFE") && !bytes.starts_with("\xFE\xFF")) return;
  throw bad_input(file, "is text in UTF-16", "a mesh saved as plain text or UTF-8");
}

}  // namespace

ClosedMesh read_closed_mesh(const std::filesystem::path& path, const Unit& unit) {
  const std::string format = format_of(path);
  const std::string bytes = read_file(path);
  require_no_utf16(bytes, path.string());
  MeshContents contents =
      format == ".stl" ? parse_stl(bytes, path.string()) : parse_obj(bytes, path.string());
  contents.mesh.vertices *= unit.to_si;
  ClosedMesh closed = closed_mesh(contents.mesh, path.string());
  closed.notes.insert(closed.notes.begin(), std::make_move_iterator(contents.notes.begin()),
                      std::make_move_iterator(contents.notes.end()));
  return closed;
}

}  // namespace tpm::organ
