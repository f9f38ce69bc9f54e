#pragma once
// Parts of the output of put_on_organ and fitted_scene, and their comparison of forces.
#include "tpm/fit/predict/organ_material.hpp"

namespace tpm::fit {

/// The block `material` of a scene.
/// @param before the block in its place, whose A0, l0 and regions stay
[[nodiscard]] Json material_block(const BondMaterial& material, const Json& before);

/// "81 mm", as scenes write it.
[[nodiscard]] std::string scene_quantity(double value, std::string_view unit);

/// A ramp and hold as a block of a scene.
[[nodiscard]] Json ramp_hold_block(double depth_m, double rate_m_per_s, double hold_s);

/// A session that steps the network of a scene along a ramp and hold, and lets it recover.
/// @param ramp with `depth`, `rate` and `hold`, as scenes write them
/// @param slowest_s the tissue's longest relaxation time
[[nodiscard]] Json network_session(std::string title, const Json& scene, const Json& ramp,
                                   double slowest_s);

/// Adds the motion as a ramp and hold where the scene has no protocol, and the session.
void add_protocol_and_session(OrganMaterial& m);

/// Fills what the forces differ by.
/// @param motions of the courses, in their order
void compare(OrganMaterial& m, const std::vector<MaterialMotion>& motions);

}  // namespace tpm::fit
