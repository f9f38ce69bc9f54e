// The hand behind tpm hil serve.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tpm/haptics/serve/simulated_hand.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::WithinAbs;

TEST_CASE("The simulated hand moves as the oscillator that it is, as late as the session says") {
  const int late = GENERATE(0, 5);
  SimulatedHandSettings settings;
  settings.plant.encoder_step_m = 0.0;
  settings.plant.delay_periods = late;
  SimulatedHand hand(settings);
  (void)hand.open();
  hand.prepare({});
  hand.enable_forces();
  const double force_N = 1.0;
  const PlantSettings& plant = settings.plant;
  const double mass = plant.mass_kg + plant.arm.mass_kg, stiffness = plant.arm.stiffness_N_per_m;
  const double half_rate = (plant.damping_N_s_per_m + plant.arm.damping_N_s_per_m) / (2.0 * mass);
  const double w = std::sqrt(stiffness / mass - half_rate * half_rate);
  Eigen::Vector3d at_m;
  for (int i = 1; i <= 300; ++i) {
    (void)hand.write({force_N, 0.0, 0.0});
    hand.advance(plant.period_s);
    (void)hand.read(at_m);
    const double t = std::max(0, i - late) * plant.period_s;
    const double exact =
        force_N / stiffness *
        (1.0 - std::exp(-half_rate * t) * (std::cos(w * t) + half_rate / w * std::sin(w * t)));
    REQUIRE_THAT(at_m.x(), WithinAbs(exact, 1e-12));
  }
}

TEST_CASE("The simulated hand stays at the set point of its arm, if it has one") {
  SimulatedHandSettings settings;
  settings.plant.arm_set_point_m = 0.004;
  settings.plant.encoder_step_m = 0.0;
  SimulatedHand hand(settings);
  (void)hand.open();
  hand.prepare({});
  hand.enable_forces();
  hand.advance(5.0);
  Eigen::Vector3d at_m;
  (void)hand.read(at_m);
  CHECK_THAT(at_m.dot(settings.plant.push), WithinAbs(0.004, 1e-9));
}

TEST_CASE("A hand that nobody holds stops at the end of its workspace, and comes back") {
  SimulatedHandSettings settings;
  settings.plant.arm = {1e-9, 0.0, 0.0, 0.0};
  settings.plant.encoder_step_m = 0.0;
  settings.reach_m = 0.05;
  SimulatedHand hand(settings);
  (void)hand.open();
  hand.prepare({});
  hand.enable_forces();
  const auto pushed = [&](const Eigen::Vector3d& force_N, int periods) {
    double farthest_m = 0.0;
    for (int i = 0; i < periods; ++i) {
      (void)hand.write(force_N);
      hand.advance(settings.plant.period_s);
      farthest_m = std::max(farthest_m, hand.state().position_m.norm());
    }
    return farthest_m;
  };
  // 0.5 N on 0.3 kg: 50 mm are behind it after 0.25 s.
  CHECK_THAT(pushed({0.5, 0.0, 0.0}, 5000), WithinAbs(settings.reach_m, 1e-12));
  CHECK(hand.state().position_m.isApprox(Eigen::Vector3d(settings.reach_m, 0.0, 0.0)));
  CHECK(hand.state().velocity_m_per_s.isZero());
  // It slides along the stop, and nothing keeps it there.
  CHECK(pushed({0.0, 0.5, 0.0}, 100) <= settings.reach_m + 1e-12);
  CHECK(hand.state().velocity_m_per_s.y() > 0.1);
  CHECK(pushed({-0.5, 0.0, 0.0}, 300) <= settings.reach_m + 1e-12);
  CHECK(hand.state().position_m.x() < 0.04);
}

TEST_CASE("The stop of the workspace is not met inside it") {
  SimulatedHandSettings near, far;
  near.plant.arm_set_point_m = far.plant.arm_set_point_m = 0.004;
  far.reach_m = 10.0;
  SimulatedHand first(near), second(far);
  for (SimulatedHand* const hand : {&first, &second}) {
    (void)hand->open();
    hand->prepare({});
    hand->enable_forces();
  }
  for (int i = 0; i < 2000; ++i) {
    for (SimulatedHand* const hand : {&first, &second}) {
      (void)hand->write({4.0 * std::sin(0.01 * i), 2.0, 1.0});
      hand->advance(near.plant.period_s);
    }
    REQUIRE(first.state().position_m == second.state().position_m);
  }
}

}  // namespace
}  // namespace tpm::haptics
