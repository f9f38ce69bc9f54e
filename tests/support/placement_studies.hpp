#pragma once
// How often intervals with a measured placement hold the true value, and how far an onset is off.
// Shared by a slow test and by the program that prints reports/fits.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "placed_recordings.hpp"

namespace tpm::test {

/// Of one parameter, or of the placement itself.
struct Held {
  std::string name;
  int held = 0, trials = 0;
  [[nodiscard]] double share() const { return static_cast<double>(held) / trials; }
};

struct PlacementCoverage {
  std::vector<Held> parameters;
  int told = 0;  ///< recordings whose drift was in the fit
  int simulations = 0;
};

/// 95 % intervals by profile likelihood, as `tpm fit` states them. The true drift of each recording
/// is drawn from a normal distribution.
inline PlacementCoverage drift_coverage(PlacedTest test, double drift_sd, int simulations,
                                        std::uint64_t seed) {
  const Recording clean = placed(test);
  const LawSpec law = spec_of(test);
  Random random(seed);
  PlacementCoverage result;
  result.simulations = simulations;
  for (int i = 0; i < simulations; ++i) {
    test.drift_N_per_s = drift_sd * random.normal();
    const PreparedRecording r = prepare_recording("made.csv", measured(test, clean, random));
    SetupOptions setup;
    setup.reference = test.reference_m;
    setup.starts = 4;
    const std::span<const PreparedRecording> one(&r, 1);
    const FitResult fit = run_fit(recording_config(law, one, setup), data_sets(one));
    std::size_t place = 0;
    for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
      const ParameterResult& p = fit.parameters[k];
      const std::string& name = p.parameter.name;
      double truth = 0.0;  // of contact
      if (k < test.material.size()) truth = test.material[k];
      if (name == "drift") {
        truth = test.drift_N_per_s;
        ++result.told;
      }
      if (name == "offset") continue;  // its time is the rest's own
      if (place == result.parameters.size()) result.parameters.push_back({name, 0, 0});
      Held& held = result.parameters[place++];
      const bool in = p.lower.value_or(-HUGE_VAL) <= truth && truth <= p.upper.value_or(HUGE_VAL);
      held.held += in ? 1 : 0;
      ++held.trials;
    }
  }
  return result;
}

/// Errors of the onset, as the force that they make at the end of the ramp over the peak.
struct OnsetErrors {
  double mean = 0.0, scatter = 0.0;  ///< of the extrapolated onset
  double stated = 0.0;               ///< its standard uncertainty, on average
  double threshold = 0.0;            ///< mean error where the force passes 3 sigma
  double part = 0.0;                 ///< of the ramp that was used, on average
};

inline OnsetErrors onset_errors(const PlacedTest& test, double exponent, int simulations,
                                std::uint64_t seed) {
  const Recording clean = placed(test);
  const double per_m = exponent / test.depth_m;
  Random random(seed);
  OnsetErrors errors;
  std::vector<double> off;
  for (int i = 0; i < simulations; ++i) {
    const Recording noisy = measured(test, clean, random);
    const PreparedRecording r = prepare_recording("made.csv", noisy);
    const RestReadings rests = read_rests(r);
    const Onset onset = find_onset(r, rests, exponent);
    off.push_back(onset.drive.value * per_m);
    errors.stated += onset.drive.sd * per_m / simulations;
    errors.part += onset.part / simulations;
    std::size_t k = 0;
    for (int above = 0; k < noisy.response.size() && above < 3; ++k) {
      above = noisy.response[k] - test.zero_N > 3.0 * test.noise_N ? above + 1 : 0;
    }
    errors.threshold += noisy.drive[k - 1] * per_m / simulations;
  }
  for (const double each : off) errors.mean += each / simulations;
  for (const double each : off) {
    errors.scatter += (each - errors.mean) * (each - errors.mean) / simulations;
  }
  errors.scatter = std::sqrt(errors.scatter);
  return errors;
}

}  // namespace tpm::test
