#pragma once
#include "tpm/accuracy/problem.hpp"

namespace tpm::accuracy {

// Contact models at servo rate (src/tpm/reduce) on the liver of 424 spheres, each at relaxation
// times from 0.2 ms to 100 s, against the full network.

/// Along the normal: ramps, holds, pokes at 100 mm/s and random probing.
[[nodiscard]] BenchmarkProblem servo_normal_problem();
/// Sideways to 2 mm, in circles, and at random in space; forces, and positions of all spheres.
[[nodiscard]] BenchmarkProblem servo_space_problem();
/// The same with the organ's inner layer fixed.
[[nodiscard]] BenchmarkProblem servo_inner_problem();

}  // namespace tpm::accuracy
