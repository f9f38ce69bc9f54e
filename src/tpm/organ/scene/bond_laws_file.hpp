#pragma once
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::organ {

/// Writes what pulls along each bond, regions and blends included, so that forces follow from the
/// file alone (docs/network.md): stiffnesses and number of its law under /bonds, the laws
/// under /laws, the material of each sphere under /spheres.
void write_bond_laws(const Tissue& tissue, files::Hdf5Writer& file);

}  // namespace tpm::organ
