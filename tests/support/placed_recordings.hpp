#pragma once
// Simulated indentations whose placement is known: rest, ramp, hold, withdrawal and rest, with a
// preload, an error of the zero and a drift. Shared by tests and by the program that measures.
#include <cmath>
#include <string>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/fit/recording/placement.hpp"
#include "tpm/fit/select/recording_setup.hpp"
#include "tpmkit/law_model.hpp"

namespace tpm::test {
using namespace fit;

/// SI units. The tissue begins at depth 0.
struct PlacedTest {
  std::string law = "linear-1";
  std::vector<double> material{60.0, 45.0, 2.0};  ///< at the reference
  double reference_m = 4e-3;
  double rest_s = 5.0, ramp_s = 2.0, hold_s = 30.0;
  double after_s = 0.0;   ///< rest after withdrawal in the ramp's time; 0: no withdrawal
  double start_m = 0.0;   ///< depth of the rest; above 0: a preload
  double depth_m = 4e-3;  ///< of the hold
  double step_s = 0.05;
  double zero_N = 0.0, drift_N_per_s = 0.0;
  double noise_N = 2e-4, phi = 0.0;
};

inline LawSpec spec_of(const PlacedTest& test) {
  LawSpec spec = parse_law_name(test.law, "law");
  spec.reference = test.reference_m;
  return spec;
}

/// The recording without noise, zero and drift. Depths count from where the machine began, not
/// from contact.
inline Recording placed(const PlacedTest& test) {
  Recording r;
  r.header.id = "made";
  const double end_s = test.rest_s + test.ramp_s + test.hold_s +
                       (test.after_s > 0.0 ? test.ramp_s + test.after_s : 0.0);
  std::vector<double> depth_m;
  for (int i = 0; i * test.step_s <= end_s * (1.0 + 1e-12); ++i) {
    const double t = i * test.step_s;
    double loaded = std::min(std::max(t - test.rest_s, 0.0) / test.ramp_s, 1.0);
    if (test.after_s > 0.0) {
      const double back = t - test.rest_s - test.ramp_s - test.hold_s;
      if (back > 0.0) loaded = std::max(1.0 - back / test.ramp_s, 0.0);
    }
    r.time_s.push_back(t);
    depth_m.push_back(test.start_m + (test.depth_m - test.start_m) * loaded);
  }
  const LawSpec spec = spec_of(test);
  std::vector<double> values = test.material;
  values.resize(law_parameters(spec).size(), 0.0);
  Protocol history = measured_history(Drive::displacement, r.time_s, depth_m);
  history.set_equilibrium_at_start(true);
  const Eigen::VectorXd force =
      LawModel(spec).respond(history, r.time_s, values, Want::values).value;
  r.response.assign(force.begin(), force.end());
  for (const double depth : depth_m) r.drive.push_back(depth - std::max(test.start_m, 0.0));
  return r;
}

/// With noise, the error of the zero and its drift.
inline Recording measured(const PlacedTest& test, Recording clean, Random& random) {
  double noise = random.normal();
  for (std::size_t i = 0; i < clean.response.size(); ++i) {
    clean.response[i] += test.zero_N + test.drift_N_per_s * clean.time_s[i] + test.noise_N * noise;
    noise = test.phi * noise + std::sqrt(1.0 - test.phi * test.phi) * random.normal();
  }
  return clean;
}

inline PreparedRecording prepared(const PlacedTest& test, std::uint64_t seed) {
  Random random(seed);
  return prepare_recording("made.csv", measured(test, placed(test), random));
}

}  // namespace tpm::test
