#pragma once
// Scenes that are quick to simulate.
#include <string>

#include "tpm/organ/run/simulation.hpp"

namespace tpm::test {
using namespace files;
using namespace organ;

inline ExperimentScene experiment(const std::string& scene) {
  return parse_experiment(parse_json(scene, "scene"), "scene", {});
}

/// A liver of 60 spheres with a material that relaxes in 0.7 s.
/// @param blocks besides organ and material, such as "\"protocol\": {...}"
inline std::string small_scene_text(const std::string& blocks) {
  return R"({"organ": {"kind": "liver", "count": 60}, "material": {"eta1": "16800 Pa s"}, )" +
         blocks + "}";
}

inline ExperimentScene small_scene(const std::string& blocks) {
  return experiment(small_scene_text(blocks));
}

inline SimulationRun run_of(const ExperimentScene& scene) {
  return simulate(scene, network_to_run(scene));
}

}  // namespace tpm::test
