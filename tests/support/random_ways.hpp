#pragma once
// Passive set-ups of device and tissue, each with a hand that moves at random.
#include <algorithm>
#include <cmath>
#include <vector>

#include "tpm/base/random.hpp"
#include "tpm/contact/element_contact.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpmkit/servo_loop.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::test {
using namespace haptics;

/// A hand that goes to random places at random speeds, over the surface and into it, and now and
/// then jerks. One motion is one way from a place to the next.
inline OperatorScript random_ways(Random& random, int ways, double deepest_m) {
  std::vector<OperatorPiece> pieces;
  double time_s = 0.0, at_m = -2e-3;
  pieces.push_back({OperatorPiece::Aim::place, time_s += 0.1, at_m, at_m});
  for (int i = 0; i < ways; ++i) {
    const double to_m = -3e-3 + (3e-3 + deepest_m) * random.uniform();
    const double slow = std::pow(10.0, -2.5 + 1.5 * random.uniform());  // 3 to 100 mm/s
    const double length_s = std::max(0.02, std::abs(to_m - at_m) / slow);
    pieces.push_back({OperatorPiece::Aim::place, time_s += std::min(length_s, 0.4), at_m, to_m});
    at_m = to_m;
  }
  return OperatorScript(std::move(pieces));
}

struct PassiveSetUp {
  PlantSettings plant;
  double stiffness_N_per_m = 0.0, relaxation_time_s = 0.0;
  TpmParameters tissue;
  OperatorScript script;
  ServoSettings servo;
};

/// The set-up of number `i`: b > K (T/2 + delay), for the largest stiffness on the way.
inline PassiveSetUp next_passive_set_up(Random& random, int i, int ways) {
  PassiveSetUp s;
  const double rates[] = {500.0, 1000.0, 2000.0};
  const double period_s = 1.0 / rates[i % 3];
  s.plant.period_s = period_s;
  s.plant.push = Eigen::Vector3d::UnitZ();
  s.plant.delay_periods = i % 4 == 0 ? 1 : 0;
  s.plant.damping_N_s_per_m = 0.1 + 0.9 * random.uniform();
  s.plant.encoder_step_m = i % 2 == 0 ? 1e-5 : 0.0;
  const double boundary = s.plant.damping_N_s_per_m / (period_s * (0.5 + s.plant.delay_periods));
  s.stiffness_N_per_m = boundary * (0.05 + 0.9 * random.uniform());
  s.relaxation_time_s = std::pow(10.0, -3.0 + 4.0 * random.uniform());
  constexpr double kDeepest_m = 8e-3;
  // Taut: E2, and the tension's slope at the deepest place with room for a hand that overshoots.
  TpmParameters p;
  const double slope = 2.0 * (1.0 - std::pow(1.0 + std::pow(14e-3 / p.spacing_m, 2), -1.5));
  p.E1_Pa = p.E2_Pa = p.Eprime_Pa =
      s.stiffness_N_per_m / (1.0 + slope) / p.modulus_to_stiffness_m();
  s.tissue = p.with_relaxation_time(s.relaxation_time_s);
  s.script = random_ways(random, ways, kDeepest_m);
  s.servo.period_s = period_s;
  s.servo.push = Eigen::Vector3d::UnitZ();
  s.servo.friction_N_s_per_m = s.plant.damping_N_s_per_m;
  s.servo.delay_periods = s.plant.delay_periods;
  s.servo.phase_ends = {static_cast<std::uint64_t>(s.script.pieces().back().end_s / period_s)};
  return s;
}

}  // namespace tpm::test
