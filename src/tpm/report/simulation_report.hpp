#pragma once
#include <string>

#include "tpm/core/namespaces.hpp"
#include "tpm/simulate/simulation.hpp"
#include "tpm/store/json.hpp"

namespace tpm::report {

/// What a run has shown, as docs/simulation_files.md describes the keys. Spheres are numbered
/// from 1.
[[nodiscard]] Json simulation_json(const ExperimentScene& scene, const RunNetwork& network,
                                   const SimulationRun& run);
[[nodiscard]] std::string simulation_text(const ExperimentScene& scene, const RunNetwork& network,
                                          const SimulationRun& run);

}  // namespace tpm::report
