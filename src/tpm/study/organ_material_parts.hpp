#pragma once
// Parts of put_on_organ that write and compare.
#include "tpm/study/organ_material.hpp"

namespace tpm {

/// The block `material` of a scene.
/// @param before the block in its place, whose A0, l0 and regions stay
[[nodiscard]] Json material_block(const BondMaterial& material, const Json& before);

/// Adds the motion as a ramp and hold where the scene has no protocol, and the session.
void add_protocol_and_session(OrganMaterial& m);

/// A measured motion in as few straight pieces as keep it within 0.2 % of its depth beyond the
/// contact (in_straight_pieces). The tissue has relaxed at its start.
[[nodiscard]] Protocol in_few_pieces(const std::vector<double>& time_s,
                                     const std::vector<double>& depth_m, double contact_m);

/// Fills what the forces differ by.
/// @param motions of the courses, in their order
void compare(OrganMaterial& m, const std::vector<MaterialMotion>& motions);

}  // namespace tpm
