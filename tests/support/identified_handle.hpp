#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <random>
#include <utility>
#include <vector>

#include "tpm/haptics/session/device_identification.hpp"

namespace tpm::test {
using namespace haptics;

/// A free handle with friction, whose positions and whose forces are late.
struct Handle {
  double mass_kg = 0.3, viscous_N_s_per_m = 0.5, coulomb_N = 0.0;
  double position_late_s = 0.0, force_late_s = 0.0, jitter_s = 0.0;
  double later_s = 0.0, later_from_s = 0.0, later_until_s = 0.0;  ///< of forces, for a while
  double encoder_step_m = 1e-5, held_N_per_m = 0.0;
  double period_s = 1e-3;
  /// Of the loop that moves it: cycles that wake late, and stalls of 2 ms to a longest time.
  double late_share = 0.0, stall_every_s = 0.0, longest_stall_s = 0.0;
};

/// Its motion in a loop of 20 s with the forces of the identification.
inline std::vector<IdentificationSample> moved(const Handle& h, std::uint64_t seed = 1) {
  constexpr int kParts = 20;
  const double part_s = h.period_s / kParts;
  const auto periods = static_cast<std::size_t>(std::lround(20.0 / h.period_s));
  std::vector<IdentificationSample> samples;
  std::vector<double> at{0.0};
  std::deque<std::pair<double, double>> coming;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  IdentifyingForce force(h.period_s, seed);
  double x = 0.0, v = 0.0, acts_N = 0.0, newest_s = 0.0;
  double stalled_until_s = 0.0, next_stall_s = h.stall_every_s;
  int missed = 0;
  for (std::size_t i = 0; i < periods; ++i) {
    const double begin_s = static_cast<double>(i) * h.period_s;
    if (h.stall_every_s > 0.0 && begin_s >= next_stall_s) {
      const double share = 0.5 * (1.0 + even(random));
      stalled_until_s = begin_s + 2e-3 + share * (h.longest_stall_s - 2e-3);
      next_stall_s += h.stall_every_s * (1.0 + 0.3 * even(random));
    }
    // The part of the period in which the loop wakes; kParts: it misses the period.
    int wakes = h.late_share > 0.0 && 0.5 * (1.0 + even(random)) < h.late_share
                    ? static_cast<int>(0.5 * (1.0 + even(random)) * kParts)
                    : 0;
    if (stalled_until_s > begin_s) {
      const double late_parts = std::ceil((stalled_until_s - begin_s) / part_s - 1e-6);
      wakes = static_cast<int>(std::min<double>(late_parts, kParts));
    }
    if (wakes >= kParts) ++missed;
    for (int part = 0; part < kParts; ++part) {
      const double time_s = begin_s + part * part_s;
      if (part == wakes) {
        const auto late = static_cast<std::size_t>(std::lround(h.position_late_s / part_s));
        const double seen = at[at.size() > late ? at.size() - 1 - late : 0];
        IdentificationSample sample;
        sample.at_m = std::round(seen / h.encoder_step_m) * h.encoder_step_m;
        sample.force_N = force.next_N(sample.at_m);
        sample.missed = missed;
        sample.late_s = part * part_s;
        missed = 0;
        samples.push_back(sample);
        const bool later = time_s >= h.later_from_s && time_s < h.later_until_s;
        const double late_s = h.force_late_s + (later ? h.later_s : 0.0);
        newest_s = std::max(newest_s, time_s + late_s + h.jitter_s * even(random));
        coming.emplace_back(newest_s, sample.force_N);
      }
      while (!coming.empty() && coming.front().first <= time_s + 1e-9) {
        acts_N = coming.front().second;
        coming.pop_front();
      }
      const double drive_N = acts_N - h.viscous_N_s_per_m * v - h.held_N_per_m * x;
      const double after = v + part_s * (drive_N - std::copysign(h.coulomb_N, v)) / h.mass_kg;
      v = h.coulomb_N > 0.0 && after * v <= 0.0 && std::abs(drive_N) < h.coulomb_N ? 0.0 : after;
      x += part_s * v;
      at.push_back(x);
    }
  }
  return samples;
}

}  // namespace tpm::test
