#include "tpm/simulate/smoothness.hpp"

namespace tpm::organ {

SmoothnessProbe::SmoothnessProbe(const ExperimentScene& scene)
    : network_(scene.tissue.network),
      neighbours_(lateral_neighbours(network_)),
      near_(spheres_around(network_, scene.probe().sphere, kNearSteps)),
      rim_(spheres_at_rim(network_, kRimAngle_rad)) {
  const Constraints constraints = scene.tissue.constraints();
  std::erase_if(rim_, [&](std::size_t i) { return !constraints.is_free(i); });
}

std::optional<Smoothness> SmoothnessProbe::at(const Positions& position) const {
  const Eigen::Matrix3Xd moved =
      position.leftCols(network_.organ.position.cols()) - network_.organ.position;
  if (moved.isZero(0.0)) return std::nullopt;
  Smoothness found{roughness(network_, neighbours_, moved, near_), std::nullopt, near_.size(),
                   rim_.size()};
  if (!rim_.empty()) found.at_rim = roughness(network_, neighbours_, moved, rim_);
  return found;
}

std::optional<Smoothness> smoothness_of(const ExperimentScene& scene, const Positions& position) {
  return SmoothnessProbe(scene).at(position);
}

}  // namespace tpm::organ
