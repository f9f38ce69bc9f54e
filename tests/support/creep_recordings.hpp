#pragma once
// Creep of 2 kPa beside 3 kPa that relax in 5 s, under a stress that is ramped and held.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tpm/base/random.hpp"
#include "tpmkit/curve.hpp"

namespace tpm::test {

struct CreepTrial {
  double rest_s = 0.0;
  double ramp_s = 2.0;
  double stress_Pa = 100.0;
  double noise = 6e-4;       ///< of the strain: 1 % of its range
  double strain_zero = 0.0;  ///< strain of the first sample, without a load
  double stress_noise_Pa = 0.0;
  std::uint64_t seed = 23;
};

/// Strain under a stress ramped from 0: J(t) = 1/5000 + (1/2000 - 1/5000)(1 - exp(-t/12.5 s)) of
/// these branches (retardation time tau (E0 + E1)/E0), integrated over the ramp's rate.
inline double creep_strain(const CreepTrial& trial, double t) {
  constexpr double kE0 = 2000.0, kE1 = 3000.0, kTau_s = 5.0;
  constexpr double kRetardation_s = kTau_s * (kE0 + kE1) / kE0;
  constexpr double kLate = 1.0 / kE0, kDelayed = 1.0 / kE0 - 1.0 / (kE0 + kE1);
  const auto integral = [](double s) {
    return kLate * s - kDelayed * kRetardation_s * (1.0 - std::exp(-s / kRetardation_s));
  };
  const double since = std::max(t - trial.rest_s, 0.0);
  const double after = std::max(since - trial.ramp_s, 0.0);
  return trial.stress_Pa / trial.ramp_s * (integral(since) - integral(after));
}

/// As tables have it: stress over strain.
inline Recording creep_recording_of(const CreepTrial& trial) {
  Recording r;
  r.header.id = "creep";
  r.drive_quantity = Quantity::strain;
  r.response_quantity = Quantity::stress;
  base::Random random(trial.seed);
  for (int i = 0; 0.1 * i <= trial.rest_s + 30.0 + 1e-9; ++i) {
    const double t = 0.1 * i;
    const double share = std::clamp((t - trial.rest_s) / trial.ramp_s, 0.0, 1.0);
    r.time_s.push_back(t);
    r.drive.push_back(trial.strain_zero + creep_strain(trial, t) + trial.noise * random.normal());
    r.response.push_back(trial.stress_Pa * share + trial.stress_noise_Pa * random.normal());
  }
  return r;
}

}  // namespace tpm::test
