#pragma once
#include <string_view>

#include "tpm/network/bond_system.hpp"

namespace tpm {

/// True for laws of the same branches on the same kernel.
[[nodiscard]] bool relax_alike(const ViscousLaw& a, const ViscousLaw& b);

/// Refuses a material in one line that names the formulations that take every material.
/// @param formulation "the condensed model"; takes "..."; has "..."
[[noreturn]] void refuse_material(std::string_view formulation, std::string_view takes,
                                  std::string_view has);

/// Refuses materials with several relaxation times, regions that relax differently and branches on
/// a kernel. Potentials may stiffen.
void require_one_relaxation(const BondSystem& bonds, std::string_view formulation);

}  // namespace tpm
