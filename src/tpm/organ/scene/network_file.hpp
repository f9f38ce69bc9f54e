#pragma once
#include <filesystem>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/organ/scene/scene.hpp"

namespace tpm::organ {

/// Writes a network to an HDF5 file and beside it, under the same name with the ending .xdmf, a
/// description that ParaView opens: the spheres as points and the bonds as lines, two blocks. Both
/// appear whole or not at all; the XDMF is written last. The contents are listed in
/// docs/network.md. Throws Error(environment).
/// @return the XDMF file
std::filesystem::path write_network(const Tissue& tissue, const std::filesystem::path& path);

/// Writes the data sets of spheres and bonds, which files of simulations hold too.
void write_network_datasets(const Tissue& tissue, Hdf5Writer& file);

}  // namespace tpm::organ
