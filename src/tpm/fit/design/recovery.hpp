#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tpm/files/json.hpp"
#include "tpm/fit/design/coverage.hpp"
#include "tpm/fit/select/selection.hpp"

namespace tpm::fit {

/// A ramp and hold as a machine records it: the probe approaches from above the surface (depth 0)
/// at the speed of the ramp.
struct SimulatedTest {
  double depth_m = 5e-3;
  double rate_m_per_s = 5e-3;
  double approach_m = 0.5e-3;     ///< above the surface at the first sample
  double hold_s = 20.0;           ///< after the ramp
  double ramp_interval_s = 0.01;  ///< between samples until the ramp ends
  double hold_interval_s = 0.05;  ///< and afterwards
};

/// The recording without noise of a law on a test.
/// @param parameters SI, in the order of law_parameters()
[[nodiscard]] Recording simulated_recording(const LawSpec& law, std::span<const double> parameters,
                                            const SimulatedTest& test);

/// Parameters with which every part of the law shows on the default test, SI: relaxation times a
/// factor of about 10 apart within the record, stiffnesses of similar size.
/// @param order alpha of a fractional element, 0 to 1
[[nodiscard]] std::vector<double> visible_parameters(const LawSpec& law, double order = 0.4);

struct RecoveryOptions {
  SimulatedTest test;
  double noise = 0.01;  ///< standard deviation of the force over its peak, > 0
  int trials = 200;     ///< >= 1
  std::uint64_t seed = 0;
  SelectionOptions selection;  ///< held-out predictions and profiles are left out
  /// Margins of BIC applied to the same fits; empty: that of `selection` alone.
  std::vector<double> margins;
};

/// Choices of select_law with one margin of BIC.
struct ChoiceCount {
  double margin = 0.0;
  int trials = 0;
  int returned = 0;  ///< the generating law
  int equivalent =
      0;           ///< another whose prediction is within one sigma of the true curve everywhere
  int larger = 0;  ///< one with more estimated parameters than the generating law
  std::map<std::string, int> chosen;   ///< how often each law was returned
  std::map<std::string, int> reasons;  ///< why the generating law was not

  [[nodiscard]] int right() const { return returned + equivalent; }
  /// At least 95 % right and at most 5 % larger.
  [[nodiscard]] bool fulfilled() const;
};

/// Counts: how often select_law returned the law that generated the data, and how often the
/// intervals of that law's own fit contained the true value.
struct RecoveryResult {
  LawSpec law;
  std::vector<double> true_values;  ///< SI, in the order of law_parameters()
  double noise = 0.0;
  std::uint64_t seed = 0;
  int trials = 0;
  int failed = 0;  ///< neither fitted nor selected: counts as wrong
  int missed =
      0;  ///< the generating law's fit ended above the deviance of a point near the true values
  std::vector<ChoiceCount> choices;           ///< one for each margin, in the order given
  std::vector<ParameterCoverage> parameters;  ///< of the material, 95 % intervals

  /// Of every margin.
  [[nodiscard]] bool fulfilled() const;
};

/// Simulates recordings with independent normal noise, selects, and counts. An interval contains
/// the true value if the deviance, minimised with the parameter fixed there, rises by no more than
/// the threshold: the profile-likelihood intervals of tpm fit, without the walk to their limits.
[[nodiscard]] RecoveryResult recover(const LawSpec& law, std::span<const double> true_values,
                                     const RecoveryOptions& options);

[[nodiscard]] Json to_json(const RecoveryResult& result);
/// One row for each law and margin, the intervals in the first row of a law.
[[nodiscard]] std::string to_terminal_text(std::span<const RecoveryResult> results);

}  // namespace tpm::fit
