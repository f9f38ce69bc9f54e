#pragma once
// Block `loads` of a scene: forces on the tissue that keep their size and direction.
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/scene/blocks.hpp"

namespace tpm::organ {

enum class LoadKind {
  gravity,   ///< the weight of every sphere
  pressure,  ///< on spheres of the outer layer, against their normals at rest
};

/// An entry of `loads` as a file says it.
struct LoadKeys {
  LoadKind kind = LoadKind::gravity;
  std::array<double, 3> direction{};
  double acceleration_m_s2 = 9.80665;
  std::optional<double> density_kg_m3, mass_kg;
  double pressure_Pa = 0.0;
  std::optional<PointKeys> centre;
  std::optional<double> radius_m;
  std::optional<std::vector<std::size_t>> spheres;
};
[[nodiscard]] const Kinds<LoadKeys, LoadKind>& load_kinds();

/// Forces on the spheres, N, and what they are in words.
struct DeadLoads {
  Eigen::Matrix3Xd force_N;  ///< empty if there are none
  std::vector<std::string> words;
};
[[nodiscard]] DeadLoads loads_of(const std::vector<LoadKeys>& loads, const Organ& organ,
                                 const DocumentPlace& place);

}  // namespace tpm::organ
