#pragma once
// Meshes as bytes of files, and how they are read.
#include <fmt/format.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>

#include "organ_meshes.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/organ/body/mesh_file.hpp"

namespace tpm::test {
using namespace organ;

inline std::string ascii_stl(const TriangleMesh& mesh) {
  std::string text = "solid body\n";
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (Eigen::Index which = 0; which < 3; ++which) {
      const Eigen::Vector3d p = mesh.corner(t, which);
      text += fmt::format("vertex {} {} {}\n", p.x(), p.y(), p.z());
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid body\n";
}

inline std::string binary_stl(const TriangleMesh& mesh) {
  std::string bytes(80, ' ');
  const auto put = [&bytes](const auto& value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof value);
  };
  put(static_cast<std::uint32_t>(mesh.triangles.cols()));
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (int zero = 0; zero < 3; ++zero) put(0.0F);
    for (Eigen::Index which = 0; which < 3; ++which) {
      const Eigen::Vector3d p = mesh.corner(t, which);
      for (const double x : p) put(static_cast<float>(x));
    }
    put(std::uint16_t{0});
  }
  return bytes;
}

inline std::string write(const TempFolder& folder, const std::string& name,
                         const std::string& bytes) {
  std::ofstream(folder / name, std::ios::binary) << bytes;
  return folder / name;
}

inline std::string file_refusal(const std::string& path) {
  return refusal_of(
      [&] { (void)read_closed_mesh(path, parse_unit("mm", Dimension::length, "test")); });
}

/// The mesh of a file, its coordinates in mm.
inline ClosedMesh read_mm(const std::string& path) {
  return read_closed_mesh(path, parse_unit("mm", Dimension::length, "test"));
}

}  // namespace tpm::test
