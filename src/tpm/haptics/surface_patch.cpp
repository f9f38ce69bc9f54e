#include "tpm/haptics/surface_patch.hpp"

#include <algorithm>

#include "tpm/core/error.hpp"
#include "tpm/reduce/condensed.hpp"

namespace tpm {

std::vector<std::size_t> facing_spheres(const Tissue& tissue, std::size_t first) {
  constexpr double kFacing = 0.5;  // cosine
  const Organ& organ = tissue.network.organ;
  const auto column = [](std::size_t sphere) { return static_cast<Eigen::Index>(sphere); };
  const auto far_m = [&](std::size_t sphere) {
    return (organ.position.col(column(sphere)) - organ.position.col(column(first))).norm();
  };
  std::vector<std::size_t> facing;
  for (std::size_t sphere = 0; sphere < organ.size(); ++sphere) {
    const bool anchored = std::binary_search(tissue.anchors.begin(), tissue.anchors.end(), sphere);
    const double cosine = organ.normal.col(column(sphere)).dot(organ.normal.col(column(first)));
    if (organ.layer[sphere] == 0 && !anchored && cosine > kFacing) facing.push_back(sphere);
  }
  std::stable_sort(facing.begin(), facing.end(),
                   [&](std::size_t a, std::size_t b) { return far_m(a) < far_m(b); });
  return facing;
}

SurfaceContact surface_patch(const Tissue& tissue, std::size_t first,
                             const SurfacePatchOptions& options) {
  const Organ& organ = tissue.network.organ;
  const BondSystem bonds = tissue.bonds();
  const Freedom freedom = tissue.freedom();
  const Eigen::Vector3d origin = organ.position.col(static_cast<Eigen::Index>(first));
  CondensedOptions condensed;
  condensed.depth_m = options.depth_m;
  condensed.period_s = options.period_s;
  std::vector<SurfacePlace> places;
  for (const std::size_t sphere : facing_spheres(tissue, first)) {
    const auto column = static_cast<Eigen::Index>(sphere);
    SurfacePlace& place = places.emplace_back();
    place.rest_m = organ.position.col(column);
    place.into = -organ.normal.col(column);
    if ((place.rest_m - origin).norm() > options.radius_m) continue;
    place.model = std::make_unique<CondensedContact>(
        build_condensed(bonds, organ.position, freedom, sphere, place.into, condensed));
  }
  return {std::move(places),
          {.tool_radius_m = options.tool_radius_m,
           .sphere_radius_m = organ.radius,
           .reach_m = organ.spacing}};
}

}  // namespace tpm
