#pragma once
// Parts of put_on_organ that write and compare.
#include "tpm/study/organ_material.hpp"

namespace tpm {

/// The block `material` of a scene.
/// @param before the block in its place, whose A0, l0 and regions stay
[[nodiscard]] Json material_block(const BondMaterial& material, const Json& before);

/// Adds the motion as a ramp and hold where the scene has no protocol, and the session.
void add_protocol_and_session(OrganMaterial& m);

/// Fills what the forces differ by.
/// @param motions of the courses, in their order
void compare(OrganMaterial& m, const std::vector<MaterialMotion>& motions);

}  // namespace tpm
