#pragma once
#include "tpm/accuracy/benchmark_case.hpp"

namespace tpm::accuracy {

// On the liver of 424 spheres of configs/liver_scene.json.

/// Ramp and hold at the fitted eta1.
[[nodiscard]] BenchmarkProblem organ_hold_problem();
/// In at 100 mm/s, held, and out, at the paper's eta1.
[[nodiscard]] BenchmarkProblem organ_poke_problem();
/// 300 s under a constant load at the fitted eta1.
[[nodiscard]] BenchmarkProblem organ_creep_problem();
/// In at 100 mm/s with masses.
[[nodiscard]] BenchmarkProblem organ_poke_mass_problem();

/// The same network with masses and bonds that do not relax: what other engines can be asked as
/// well. Sampled between the kinks of the protocol.
[[nodiscard]] std::shared_ptr<const BenchmarkCase> elastic_poke_case();
/// Every method on a poke of a network with masses; to be given name, title and text.
[[nodiscard]] BenchmarkProblem poke_with_mass_problem(
    const std::shared_ptr<const BenchmarkCase>& benchmark);

}  // namespace tpm::accuracy
