#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "tpm/files/json.hpp"
#include "tpm/fit/likelihood/config.hpp"

namespace tpm::fit {

/// Coverage of the intervals of one parameter: how often they contained the true value.
struct ParameterCoverage {
  std::string name;
  int covered = 0;
  int one_sided = 0;     ///< intervals open on one side or both (they may cover too often)
  double p_value = 1.0;  ///< exact two-sided binomial test of covered against the level
};

struct CoverageResult {
  std::uint64_t seed = 0;
  double level = 0.95;
  int sets = 0;    ///< data sets simulated and fitted
  int failed = 0;  ///< of them, fits that could not be done
  std::vector<ParameterCoverage> parameters;
};

/// Simulates data sets from the configuration with its start values as the true values and its
/// declared noise, fits each with profiles, and counts. Depths, loads and times are those of the
/// data sets; their measured values are not used. Throws Error(bad_input) for bands (a band has no
/// noise model to simulate) and for a robust loss (whose deviance has no chi-square distribution).
[[nodiscard]] CoverageResult check_coverage(const FitConfig& config, int sets, std::uint64_t seed);

[[nodiscard]] Json to_json(const CoverageResult& result);
[[nodiscard]] std::string to_terminal_text(const CoverageResult& result);

/// Probability, under Binomial(n, p), of a count at most as likely as `k` (exact, two-sided).
[[nodiscard]] double binomial_test(int k, int n, double p);

}  // namespace tpm::fit
