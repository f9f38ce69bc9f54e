#pragma once
// Simulated recordings whose true values are known: how often bands and intervals hold it. Shared
// by the slow tests and by the programs that print the tables of reports/chain.
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <optional>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/fit/design/coverage.hpp"
#include "tpm/fit/design/recovery.hpp"
#include "tpm/fit/fitted_law.hpp"
#include "tpm/fit/online/identification.hpp"
#include "tpm/fit/predict/law_prediction.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::test {
using namespace fit;

/// Successes of independent trials.
struct Count {
  int held = 0, trials = 0;
  void add(bool holds) {
    held += holds ? 1 : 0;
    ++trials;
  }
  [[nodiscard]] double share() const { return static_cast<double>(held) / trials; }
};

/// Probability of a count at least as far from its expectation, by the exact binomial: twice the
/// smaller tail, at most 1.
inline double binomial_p(const Count& count, double expected) {
  const boost::math::binomial law(count.trials, expected);
  const double below = boost::math::cdf(law, count.held);
  const double above =
      count.held > 0 ? boost::math::cdf(boost::math::complement(law, count.held - 1)) : 1.0;
  return std::min(1.0, 2.0 * std::min(below, above));
}

/// Adds noise of a standard deviation, an autoregression of first order.
inline void add_noise(Recording& recording, double sigma, double phi, Random& random) {
  double noise = random.normal();
  for (double& response : recording.response) {
    response += sigma * noise;
    noise = phi * noise + std::sqrt(1.0 - phi * phi) * random.normal();
  }
}

/// A ramp of 1 s to 4 mm and a hold, evenly sampled.
inline SimulatedTest even_test(double hold_s, double interval_s) {
  SimulatedTest test;
  test.depth_m = 4e-3;
  test.rate_m_per_s = 4e-3;
  test.approach_m = 0.2e-3;
  test.hold_s = hold_s;
  test.ramp_interval_s = test.hold_interval_s = interval_s;
  return test;
}

struct HeldOutCoverage {
  Count readings;             ///< one held-out reading of each simulation, at random, in its band
  Count means;                ///< the true value there in the band of the mean
  double all_readings = 0.0;  ///< share of all held-out readings that lie in their bands
  int failed = 0;
};

/// Recordings whose first half of the hold is fitted and whose second half is predicted.
inline HeldOutCoverage held_out_coverage(const LawSpec& family, const SimulatedTest& test,
                                         double noise, double phi, int simulations,
                                         std::uint64_t seed) {
  LawSpec law = family;
  law.reference = test.depth_m;
  const std::vector<double> true_values = visible_parameters(law);
  const Recording clean = simulated_recording(law, true_values, test);
  const double peak = *std::max_element(clean.response.begin(), clean.response.end());
  Random random(seed);
  HeldOutCoverage result;
  double inside = 0.0;
  int of = 0;
  for (int i = 0; i < simulations; ++i) {
    Recording recording = clean;
    recording.header.sha256 = "simulated";
    add_noise(recording, noise * peak, phi, random);
    PreparedRecording whole = prepare_recording("simulated", recording);
    PreparedRecording half = whole;
    half.to_s = whole.to_s - 0.5 * test.hold_s;
    SetupOptions setup;
    setup.profiles = false;
    setup.reference = law.reference;
    const std::span<const PreparedRecording> one(&half, 1);
    const FitResult fit = run_fit(recording_config(law, one, setup), data_sets(one));
    const LawFile fitted = fitted_law(fit);
    if (!fitted.uncertainty) {
      ++result.failed;
      continue;
    }
    const LawPrediction p = predict_recording(fitted, whole, {});
    std::vector<std::size_t> held_out;
    for (std::size_t k = 0; k < p.time_s.size(); ++k) {
      if (!p.recording->in_window[k] || p.recording->was_fitted[k]) continue;
      if (p.time_s[k] > half.to_s) held_out.push_back(k);
    }
    const auto in = [&](std::size_t k) {
      return recording.response[k] >= p.reading_lower[k] &&
             recording.response[k] <= p.reading_upper[k];
    };
    for (const std::size_t k : held_out) inside += in(k) ? 1.0 : 0.0;
    of += static_cast<int>(held_out.size());
    const std::size_t k = held_out[random.below(held_out.size())];
    result.readings.add(in(k));
    result.means.add(clean.response[k] >= p.mean_lower[k] && clean.response[k] <= p.mean_upper[k]);
  }
  result.all_readings = inside / of;
  return result;
}

/// Intervals of a whole recording's fit that hold the true value, one for each material parameter:
/// by profile likelihood, as `tpm fit` states them; a side without a limit holds everything.
struct FitCoverage {
  std::vector<std::string> names;
  std::vector<Count> parameters;
};

/// Fits of simulated recordings whose contact lies between two samples in noise.
/// @param nuisance whether contact is estimated, or fixed where it was found
inline FitCoverage fit_coverage(const LawSpec& family, const SimulatedTest& test, double noise,
                                double phi, Nuisance nuisance, int simulations,
                                std::uint64_t seed) {
  LawSpec law = family;
  law.reference = test.depth_m;
  const std::vector<double> true_values = visible_parameters(law);
  const Recording clean = simulated_recording(law, true_values, test);
  const double peak = *std::max_element(clean.response.begin(), clean.response.end());
  Random random(seed);
  FitCoverage result;
  for (int i = 0; i < simulations; ++i) {
    Recording recording = clean;
    add_noise(recording, noise * peak, phi, random);
    const PreparedRecording prepared = prepare_recording("simulated", recording);
    SetupOptions setup;
    setup.reference = law.reference;
    setup.nuisance = nuisance;
    const std::span<const PreparedRecording> one(&prepared, 1);
    const FitResult fit = run_fit(recording_config(law, one, setup), data_sets(one));
    for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
      const std::string& name = fit.parameters[k].parameter.name;
      if (name == "offset" || name == "contact" || name == "drift") continue;
      if (k == result.names.size()) {
        result.names.push_back(name);
        result.parameters.emplace_back();
      }
      const ParameterResult& p = fit.parameters[k];
      const bool above = p.lower.value_or(-HUGE_VAL) <= true_values[k];
      result.parameters[k].add(above && true_values[k] <= p.upper.value_or(HUGE_VAL));
    }
  }
  return result;
}

struct StoppedCoverage {
  std::vector<std::string> names;
  std::vector<Count> parameters;  ///< intervals that hold the true value at the stopping time
  int stopped = 0, simulations = 0;
  double mean_stop_s = 0.0, mean_samples = 0.0;
  int other_law = 0;  ///< stopped with a law that is not the one simulated
};

/// Identification of simulated recordings until it stops.
/// @param laws to choose from; the simulated one alone, or several
inline StoppedCoverage stopped_coverage(const LawSpec& family, const SimulatedTest& test,
                                        double noise, double phi, IdentifyOptions options,
                                        int simulations, std::uint64_t seed) {
  LawSpec law = family;
  law.reference = test.depth_m;
  options.reference = test.depth_m;
  if (options.laws.empty()) options.laws = {law};
  const std::vector<double> true_values = visible_parameters(law);
  const Recording clean = simulated_recording(law, true_values, test);
  const double peak = *std::max_element(clean.response.begin(), clean.response.end());
  const std::vector<LawParameter> table = law_parameters(law);
  StoppedCoverage result;
  for (const LawParameter& p : table) {
    if (p.nuisance || p.preset) continue;
    result.names.push_back(p.name);
    result.parameters.emplace_back();
  }
  Random random(seed);
  for (int i = 0; i < simulations; ++i) {
    Recording recording = clean;
    add_noise(recording, noise * peak, phi, random);
    const Identification id = identify(prepare_recording("simulated", recording), options);
    ++result.simulations;
    if (!id.stopped) continue;
    ++result.stopped;
    const IdentifiedSample& s = id.result();
    result.mean_stop_s += s.time_s;
    result.mean_samples += static_cast<double>(s.estimate.samples);
    if (law_name(id.laws[s.law]) != law_name(law)) {
      ++result.other_law;
      continue;
    }
    for (const SequentialParameter& p : s.estimate.parameters) {
      for (std::size_t k = 0; k < result.names.size(); ++k) {
        if (result.names[k] != table[p.place].name) continue;
        result.parameters[k].add(true_values[p.place] >= p.lower &&
                                 true_values[p.place] <= p.upper);
      }
    }
  }
  if (result.stopped > 0) {
    result.mean_stop_s /= result.stopped;
    result.mean_samples /= result.stopped;
  }
  return result;
}

}  // namespace tpm::test
