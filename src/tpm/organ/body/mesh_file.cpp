#include "tpm/organ/body/mesh_file.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"
#include "tpmkit/error.hpp"

namespace tpm::organ {

namespace {

/// Cutting a polygon into triangles costs the square of its corners.
constexpr unsigned kMostCorners = 1000;

/// Opens nothing: a mesh may name other files (`mtllib` in OBJ), and none of them is needed.
class NoOtherFiles : public Assimp::IOSystem {
 public:
  bool Exists(const char* /*name*/) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* /*name*/, const char* /*mode*/) override { return nullptr; }
  void Close(Assimp::IOStream* /*file*/) override {}
};

/// "stl" or "obj". Others are refused even where Assimp reads them: nobody has tried them here.
std::string format_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](char letter) {
    return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
  });
  if (ending == ".stl" || ending == ".obj") return ending.substr(1);
  throw bad_input(path.string(),
                  fmt::format("the ending '{}' is no known format", printable(ending)),
                  "a closed surface in .stl or .obj");
}

Eigen::Index triangle_count(const aiMesh& mesh) {
  return std::count_if(mesh.mFaces, mesh.mFaces + mesh.mNumFaces,
                       [](const aiFace& face) { return face.mNumIndices == 3; });
}

void append(const aiMesh& from, double scale, TriangleMesh& to) {
  const Eigen::Index first_vertex = to.vertices.cols();
  to.vertices.conservativeResize(3, first_vertex + static_cast<Eigen::Index>(from.mNumVertices));
  for (unsigned v = 0; v < from.mNumVertices; ++v) {
    const aiVector3D& p = from.mVertices[v];
    to.vertices.col(first_vertex + static_cast<Eigen::Index>(v)) =
        scale * Eigen::Vector3d(p.x, p.y, p.z);
  }
  Eigen::Index t = to.triangles.cols();
  to.triangles.conservativeResize(3, t + triangle_count(from));
  for (unsigned f = 0; f < from.mNumFaces; ++f) {
    const aiFace& face = from.mFaces[f];
    if (face.mNumIndices != 3) continue;  // a loose point or line bounds nothing
    for (Eigen::Index which = 0; which < 3; ++which) {
      to.triangles(which, t) =
          static_cast<int>(first_vertex) + static_cast<int>(face.mIndices[which]);
    }
    ++t;
  }
}

void require_small_faces(const aiScene& scene, std::string_view file) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices <= kMostCorners) continue;
      throw bad_input(file, fmt::format("a face has {} corners", mesh.mFaces[f].mNumIndices),
                      fmt::format("at most {}; triangles are best", kMostCorners));
    }
  }
}

}  // namespace

ClosedMesh read_closed_mesh(const std::filesystem::path& path, const Unit& unit) {
  const std::string format = format_of(path);
  const std::string bytes = read_file(path);
  Assimp::Importer importer;
  importer.SetIOHandler(new NoOtherFiles);  // the importer owns it
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), 0, format.c_str());
  if (scene != nullptr) {
    require_small_faces(*scene, path.string());
    scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  }
  if (scene == nullptr) {
    throw bad_input(path.string(),
                    fmt::format("cannot be read: {}", printable(importer.GetErrorString(), 200)),
                    fmt::format("an {} file", format == "stl" ? "STL" : "OBJ"));
  }
  TriangleMesh mesh;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) append(*scene->mMeshes[m], unit.to_si, mesh);
  return closed_mesh(mesh, path.string());
}

}  // namespace tpm::organ
