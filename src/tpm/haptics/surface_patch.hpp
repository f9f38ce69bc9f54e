#pragma once
#include <vector>

#include "tpm/scene/scene.hpp"
#include "tpm/servo/surface_contact.hpp"

namespace tpm {

struct SurfacePatchOptions {
  double radius_m = 0.025;  ///< places so near to the first contact have a model; > 0
  double depth_m = 8e-3;    ///< the models' range, > 0
  double period_s = 1e-3;   ///< of the servo loop, > 0
  double tool_radius_m = 5e-3;
};

/// The spheres of a tissue's outermost layer that look the way a first one does (within 60 degrees;
/// the far side of the organ does not), from near to far; anchored ones left out.
/// @param first from 0, of the outermost layer
[[nodiscard]] std::vector<std::size_t> facing_spheres(const Tissue& tissue, std::size_t first);

/// A condensed model for each of the spheres near a first one; those around have none, so that it
/// is seen where the tool leaves the patch. Balances the network at some 150 places for each.
/// Throws as build_condensed().
[[nodiscard]] SurfaceContact surface_patch(const Tissue& tissue, std::size_t first,
                                           const SurfacePatchOptions& options);

}  // namespace tpm
