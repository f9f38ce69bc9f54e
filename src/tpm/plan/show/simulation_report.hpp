#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/run/simulation.hpp"

namespace tpm::plan {

/// What a run has shown, as docs/data_formats.md describes the keys. Spheres are numbered
/// from 1.
[[nodiscard]] Json simulation_json(const ExperimentScene& scene, const RunNetwork& network,
                                   const SimulationRun& run);
[[nodiscard]] std::string simulation_text(const ExperimentScene& scene, const RunNetwork& network,
                                          const SimulationRun& run);

}  // namespace tpm::plan
