#pragma once
// Scenes that are quick to simulate.
#include <string>

#include "tpm/organ/run/simulation.hpp"

namespace tpm::test {
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

/// A ball that presses one sphere on a spring, is struck when it speeds up at 0.1022 s, and meets
/// the sphere again after it has stopped at 0.1122 s. Its contact settles for 1.3 ms after each.
inline constexpr const char* kStruckStar =
    R"({"organ": {"kind": "star"}, "material": {"eta1": "1e12 Pa s"},
    "formulation": {"kind": "inertial"}, "tolerance": 1e-6, "outputs": {"count": 2001},
    "contacts": [{"kind": "ball", "radius": "10 mm", "mass_kg": 0.05, "stiffness": "1e6 N/m"}],
    "protocol": {"kind": "knots", "knots": [{"time": "0 s", "depth": "0 mm"},
      {"time": "0.1022 s", "depth": "0.001 mm"}, {"time": "0.1122 s", "depth": "0.05 mm"},
      {"time": "0.2 s", "depth": "0.05 mm"}]}})";

inline SimulationRun run_of(const ExperimentScene& scene) {
  return simulate(scene, network_to_run(scene));
}

}  // namespace tpm::test
