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

/// The stress is taken away again after 30 s: by superposition the strain of a second ramp is
/// subtracted.
inline Recording with_recovery(const CreepTrial& trial) {
  constexpr double kTakenAway_s = 30.0;
  CreepTrial away = trial;
  away.rest_s = kTakenAway_s;
  Recording r = creep_recording_of(trial);
  base::Random random(5);
  for (double t = 30.1; t < 90.05; t += 0.1) {
    r.time_s.push_back(t);
    r.drive.push_back(creep_strain(trial, t) - creep_strain(away, t) +
                      trial.noise * random.normal());
    r.response.push_back(trial.stress_Pa *
                         (1.0 - std::clamp((t - kTakenAway_s) / trial.ramp_s, 0.0, 1.0)));
  }
  return r;
}

/// Creep of an indentation through contact: 2 and 3 kN/m at a depth of `reference_m`, times u (u /
/// reference)^(power - 1), so that V = u^power / reference^(power - 1) creeps as a strain does.
struct PressTrial {
  CreepTrial creep{.rest_s = 4.0, .ramp_s = 2.0, .stress_Pa = 8.0, .noise = 0.0};
  double power = 1.5;
  double reference_m = 4e-3;
  double contact_m = 1e-3;  ///< the probe comes nearer at rest
  double zero_N = 0.02;
  double noise_m = 4e-5;  ///< 1 % of the depth
  double noise_N = 4e-4;
};

/// As tables have it: force over depth.
inline Recording press_recording_of(const PressTrial& trial) {
  Recording r;
  r.header.id = "press";
  r.drive_quantity = Quantity::indentation_depth;
  r.response_quantity = Quantity::contact_force;
  base::Random random(trial.creep.seed);
  const double rest_s = trial.creep.rest_s;
  for (int i = 0; 0.1 * i <= rest_s + 30.0 + 1e-9; ++i) {
    const double t = 0.1 * i;
    const double v = creep_strain(trial.creep, t);
    const double nearer = rest_s > 0.0 ? std::min(t / rest_s, 1.0) : 1.0;
    const double u = std::pow(v * std::pow(trial.reference_m, trial.power - 1.0), 1 / trial.power);
    const double share = std::clamp((t - rest_s) / trial.creep.ramp_s, 0.0, 1.0);
    r.time_s.push_back(t);
    r.drive.push_back(trial.contact_m * nearer + u + trial.noise_m * random.normal());
    r.response.push_back(trial.zero_N + trial.creep.stress_Pa * share +
                         trial.noise_N * random.normal());
  }
  return r;
}

}  // namespace tpm::test
