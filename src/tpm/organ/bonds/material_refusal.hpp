#pragma once
#include <initializer_list>
#include <string_view>
#include <vector>

#include "tpm/organ/bonds/bond_system.hpp"
#include "tpmkit/formulation.hpp"

namespace tpm::organ {

/// True for laws of the same branches on the same kernel.
[[nodiscard]] bool relax_alike(const ViscousLaw& a, const ViscousLaw& b);

/// The branches of the bonds that relax, where they relax alike; none if nothing relaxes.
[[nodiscard]] std::vector<ViscousLaw::Branch> common_branches(const BondSystem& bonds);

/// A capability that a material asks of a formulation.
using MaterialNeed = bool Capabilities::*;

/// Abilities that the materials of some bonds need of a formulation: `mixed`, `kernels`,
/// `branches`, `any_potential`, `stiffening`, those that apply, in this order. Factors of place do
/// not show in bonds: see needs_of(MaterialField).
[[nodiscard]] std::vector<MaterialNeed> needs_of(const BondSystem& bonds);
/// `regions`, if there are any.
[[nodiscard]] std::vector<MaterialNeed> needs_of(const MaterialField& field);

/// Throws Error(bad_input) in one line that names the formulations with the capability, for the
/// first need of the bonds that is not among those taken.
/// @param who refuses, such as "the condensed model"
void require_material(const BondSystem& bonds, std::string_view who,
                      std::initializer_list<MaterialNeed> takes);

}  // namespace tpm::organ
