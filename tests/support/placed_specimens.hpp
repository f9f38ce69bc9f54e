#pragma once
// Recordings of one material to unequal depths, from unequal preloads, with unequal zeros, fitted
// and pooled as `tpm fit FOLDER` does. Shared by a test and by the program that measures.
#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "placed_recordings.hpp"
#include "tpm/fit/groups/specimens.hpp"
#include "tpm/fit/verdict.hpp"

namespace tpm::test {

/// SI units.
struct PlacedSpecimens {
  std::string law = "hertz-1";
  std::vector<double> material{60.0, 45.0, 2.0};  ///< at reference_m
  double reference_m = 4e-3;
  double noise = 2e-3;  ///< standard deviation of a reading, of the recording's own peak
  int recordings = 10;
  int without_rest = 3;  ///< of these, that begin in contact
};

/// Ramps of 2 mm/s to 2 to 8 mm, each held for 30 s, 10 samples per second, zero off by up to 5 mN.
/// Those with a rest begin up to 1 mm above the tissue and rest for 2 to 20 s; those without begin
/// 0.05 to 0.5 mm deep, half of them with the ramp and half with up to 2 s of equilibrium there.
inline std::vector<PreparedRecording> placed_specimens(const PlacedSpecimens& study,
                                                       Random& random) {
  const auto between = [&](double low, double high) {
    return low + (high - low) * random.uniform();
  };
  std::vector<PreparedRecording> recordings;
  for (int i = 0; i < study.recordings; ++i) {
    PlacedTest test;
    test.law = study.law;
    test.material = study.material;
    test.reference_m = study.reference_m;
    test.step_s = 0.1;
    test.depth_m = between(2e-3, 8e-3);
    test.zero_N = between(-5e-3, 5e-3);
    if (i < study.without_rest) {
      test.start_m = between(0.05e-3, 0.5e-3);
      test.rest_s = std::max(between(-2.0, 2.0), 0.0);
    } else {
      test.start_m = between(-1e-3, 0.0);
      test.rest_s = between(2.0, 20.0);
    }
    test.ramp_s = (test.depth_m - test.start_m) / 2e-3;
    const Recording clean = placed(test);
    test.noise_N = study.noise * *std::ranges::max_element(clean.response);
    recordings.push_back(
        prepare_recording(fmt::format("{}.csv", i), measured(test, clean, random)));
  }
  return recordings;
}

/// Smallest and largest of some estimates.
struct EstimateRange {
  int count = 0;
  double least = HUGE_VAL, most = 0.0;

  void add(double estimate) {
    ++count;
    least = std::min(least, estimate);
    most = std::max(most, estimate);
  }
  /// Infinite where one is 0; none of fewer than two.
  [[nodiscard]] std::optional<double> ratio() const {
    return count < 2 ? std::nullopt : std::optional(most / least);
  }
};

/// One coefficient over the recordings of one material, at the study's reference depth.
struct CoefficientSpread {
  std::string name;
  double truth = 0.0;              ///< there, SI
  EstimateRange fitted;            ///< of all recordings that could be fitted
  EstimateRange identified;        ///< of those that call it identified, without a condition
  std::optional<double> distance;  ///< pooled mean less the true value, in its standard errors
  bool held = false;               ///< the pooled 95 % interval holds the true value
  bool pooled_identified = false;  ///< false: "not identified", or not pooled
};

/// k_inf and k1 of a law of one branch.
inline std::vector<CoefficientSpread> coefficient_spreads(const PlacedSpecimens& study,
                                                          Random& random) {
  const LawSpec law = parse_law_name(study.law, "law");
  const SpecimenStudy found = study_specimens(placed_specimens(study, random), law, {});
  // A coefficient is a secant: k at a depth u is k (u / reference)^(exponent - 1).
  const double exponent = first_loading_exponent(law, {}).value();
  const double deeper = std::pow(found.law.reference / study.reference_m, exponent - 1.0);
  std::vector<CoefficientSpread> spreads;
  for (const std::size_t i : {0, 1}) {
    CoefficientSpread spread;
    spread.truth = deeper * study.material[i];
    for (const SpecimenRow& row : found.rows) {
      if (!row.fit) continue;
      const ParameterResult& p = row.parameter(i);
      spread.name = p.parameter.name;
      spread.fitted.add(p.estimate);
      if (verdict_text(p) == "identified") spread.identified.add(p.estimate);
    }
    for (const PooledParameter& p : found.pooled) {
      if (p.parameter.name != spread.name) continue;
      const RandomEffects& e = p.effects;
      const double truth = p.parameter.theta(spread.truth);
      spread.distance = (e.mean - truth) / e.standard_error;
      spread.held = e.interval.lower <= truth && truth <= e.interval.upper;
      spread.pooled_identified = p.identified();
    }
    spreads.push_back(spread);
  }
  return spreads;
}

}  // namespace tpm::test
