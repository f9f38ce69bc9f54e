#pragma once
#include <filesystem>

#include "tpm/organ/run/simulation.hpp"

namespace tpm::organ {

/// Writes a result to an HDF5 file and beside it, under the same name with the ending .xdmf, a
/// description that ParaView opens as a network in motion. Both appear whole or not at all; the
/// XDMF is written last. The contents are listed in docs/data_formats.md. Throws
/// Error(environment).
/// @return the XDMF file
std::filesystem::path write_simulation(const ExperimentScene& scene, const RunNetwork& network,
                                       const SimulationRun& run, const std::filesystem::path& path);

}  // namespace tpm::organ
