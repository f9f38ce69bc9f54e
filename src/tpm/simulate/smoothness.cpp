#include "tpm/simulate/smoothness.hpp"

#include <algorithm>

#include "tpm/network/roughness.hpp"

namespace tpm {

std::optional<Smoothness> smoothness_of(const ExperimentScene& scene, const Positions& position) {
  const Network& network = scene.tissue.network;
  const Eigen::Matrix3Xd moved =
      position.leftCols(network.organ.position.cols()) - network.organ.position;
  if (moved.isZero(0.0)) return std::nullopt;
  const std::vector<std::size_t> near = spheres_around(network, scene.probe().sphere, kNearSteps);
  const Freedom freedom = scene.tissue.freedom();
  std::vector<std::size_t> rim = spheres_at_rim(network, kRimAngle_rad);
  std::erase_if(rim, [&](std::size_t i) { return !freedom.is_free(i); });
  Smoothness found{roughness(network, moved, near), std::nullopt, near.size(), rim.size()};
  if (!rim.empty()) found.at_rim = roughness(network, moved, rim);
  return found;
}

}  // namespace tpm
