#pragma once
#include <string>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/organ/run/simulation.hpp"
#include "tpm/show/short_answer.hpp"

namespace tpm::plan {

/// Result of a run, as docs/data_formats.md describes the keys. Spheres are numbered
/// from 1.
[[nodiscard]] Json simulation_json(const ExperimentScene& scene, const RunNetwork& network,
                                   const SimulationRun& run);
[[nodiscard]] std::string simulation_text(const ExperimentScene& scene, const RunNetwork& network,
                                          const SimulationRun& run);
/// The short answer: the largest and the last response, what touches, how far the run can be relied
/// on, and every warning.
[[nodiscard]] ShortAnswer short_answer(const ExperimentScene& scene, const RunNetwork& network,
                                       const SimulationRun& run);

}  // namespace tpm::plan
