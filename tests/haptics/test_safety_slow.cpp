// A million random motions of passive set-ups, none of which may be stopped.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "shaken_contact.hpp"
#include "tpm/base/random.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpmkit/servo_loop.hpp"
#include "tpmkit/tpm_element.hpp"

namespace tpm::haptics {
namespace {

/// A hand that goes to random places at random speeds, over the surface and into it, and now and
/// then jerks. One motion is one way from a place to the next.
OperatorScript random_ways(Random& random, int ways, double deepest_m) {
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

TEST_CASE("No motion of a million of passive set-ups is stopped") {
  constexpr int kSetUps = 1000, kWays = 1000;
  Random random(2024);
  double most_delivered_J = 0.0;
  for (int i = 0; i < kSetUps; ++i) {
    // Passive: b > K (T/2 + delay), for the largest stiffness on the way.
    const double rates[] = {500.0, 1000.0, 2000.0};
    const double period_s = 1.0 / rates[i % 3];
    PlantSettings plant;
    plant.period_s = period_s;
    plant.push = Eigen::Vector3d::UnitZ();
    plant.delay_periods = i % 4 == 0 ? 1 : 0;
    plant.damping_N_s_per_m = 0.1 + 0.9 * random.uniform();
    plant.encoder_step_m = i % 2 == 0 ? 1e-5 : 0.0;
    const double boundary = plant.damping_N_s_per_m / (period_s * (0.5 + plant.delay_periods));
    const double stiffness = boundary * (0.05 + 0.9 * random.uniform());
    const double tau_s = std::pow(10.0, -3.0 + 4.0 * random.uniform());
    TpmParameters p;
    const double deepest_m = 8e-3;
    // Taut: E2, and the tension's slope at the deepest place with room for a hand that overshoots.
    const double slope = 2.0 * (1.0 - std::pow(1.0 + std::pow(14e-3 / p.spacing_m, 2), -1.5));
    p.E1_Pa = p.E2_Pa = p.Eprime_Pa = stiffness / (1.0 + slope) / p.modulus_to_stiffness_m();
    ElementContact model(p.with_relaxation_time(tau_s), period_s);
    const OperatorScript script = random_ways(random, kWays, deepest_m);
    VirtualOmega7 device(plant, script);
    (void)device.open();
    device.prepare({});
    device.enable_forces();
    ServoSettings settings;
    settings.period_s = period_s;
    settings.push = Eigen::Vector3d::UnitZ();
    settings.friction_N_s_per_m = plant.damping_N_s_per_m;
    settings.delay_periods = plant.delay_periods;
    settings.phase_ends = {static_cast<std::uint64_t>(script.pieces().back().end_s / period_s)};
    double delivered_J = 0.0;
    ServoStep step(device, model, settings);
    ServoRecord row;
    StopCause cause = StopCause::none;
    while (cause == StopCause::none) {
      cause = step.cycle(0, row);
      device.advance(period_s);
    }
    delivered_J = step.energy().most_delivered_J();
    most_delivered_J = std::max(most_delivered_J, delivered_J);
    CAPTURE(i, period_s, stiffness, plant.damping_N_s_per_m, tau_s, delivered_J, row.cycle);
    INFO(word_of(cause));
    REQUIRE(cause == StopCause::finished);
  }
  WARN("largest energy given: " << 1e3 * most_delivered_J << " mJ of the 2 mJ that stop a session");
  CHECK(most_delivered_J < 2e-3);
}

}  // namespace
}  // namespace tpm::haptics
