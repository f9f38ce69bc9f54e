#pragma once
#include <filesystem>

#include "tpm/organ/run/simulation.hpp"

namespace tpm::organ {

/// Writes the outputs of a run as VTKHDF 2.0 (the file format of VTK from 9.3 and ParaView from
/// 5.12 on): one unstructured grid in motion, the spheres its points and the bonds its lines, with
/// the fields that the XDMF has; of /steps in SI units. Appears whole or not at all. Throws
/// Error(environment).
void write_vtkhdf(const ExperimentScene& scene, const RunNetwork& network, const SimulationRun& run,
                  const std::filesystem::path& path);

}  // namespace tpm::organ
