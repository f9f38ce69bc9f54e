#pragma once
#include "tpm/accuracy/problem.hpp"

namespace tpm::accuracy {

/// eta1 of the README's first fit, `tpm fit configs/liver_relaxation.json`.
inline constexpr double kFittedEta1_Pa_s = 257.3e3;
/// The paper's eta1, and its E1 + E2.
inline constexpr double kPaperEta1_Pa_s = 5.0, kPaperSprings_Pa = 24e3;

/// Ramp and hold of one bond at the paper's eta1.
[[nodiscard]] BenchmarkProblem bond_paper_problem();
/// The same at the fitted eta1.
[[nodiscard]] BenchmarkProblem bond_fitted_problem();
/// The star under a constant load.
[[nodiscard]] BenchmarkProblem star_creep_problem();
/// One sphere with mass under a suddenly applied load.
[[nodiscard]] BenchmarkProblem bond_mass_problem();

}  // namespace tpm::accuracy
