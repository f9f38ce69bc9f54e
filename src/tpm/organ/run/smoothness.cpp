#include "tpm/organ/run/smoothness.hpp"

namespace tpm::organ {

namespace {

std::vector<std::size_t> free_spheres_at_rim(const ExperimentScene& scene) {
  std::vector<std::size_t> rim = spheres_at_rim(scene.tissue.network, kRimAngle_rad);
  const Constraints constraints = scene.tissue.constraints();
  std::erase_if(rim, [&](std::size_t i) { return !constraints.is_free(i); });
  return rim;
}

}  // namespace

SmoothnessProbe::SmoothnessProbe(const ExperimentScene& scene)
    : SmoothnessProbe(scene.tissue.network,
                      spheres_around(scene.tissue.network, scene.probe().sphere, kNearSteps),
                      free_spheres_at_rim(scene)) {}

SmoothnessProbe::SmoothnessProbe(const Network& network, const std::vector<std::size_t>& near,
                                 const std::vector<std::size_t>& rim)
    : network_(network),
      near_spheres_(near.size()),
      rim_spheres_(rim.size()),
      near_(network, near),
      rim_(network, rim) {}

std::optional<Smoothness> SmoothnessProbe::at(const Positions& position) const {
  const Eigen::Matrix3Xd moved =
      position.leftCols(network_.organ.position.cols()) - network_.organ.position;
  if (moved.isZero(0.0)) return std::nullopt;
  Smoothness found{roughness(near_, moved), std::nullopt, near_spheres_, rim_spheres_};
  if (rim_spheres_ > 0) found.at_rim = roughness(rim_, moved);
  return found;
}

std::optional<Smoothness> smoothness_of(const ExperimentScene& scene, const Positions& position) {
  return SmoothnessProbe(scene).at(position);
}

}  // namespace tpm::organ
