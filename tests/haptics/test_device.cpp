// The simulated device and its operator against closed forms; replay.
#include <catch2/catch.hpp>
#include <cmath>

#include "operator_lines.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/haptics/device/replay_device.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

PlantSettings bare() {
  PlantSettings s;
  s.encoder_step_m = 0.0;
  s.arm.correction_per_s = 0.0;
  s.push = Eigen::Vector3d::UnitX();
  return s;
}

OperatorScript still(double at_m = 0.0) {
  return OperatorScript({{OperatorPiece::Aim::place, 1e9, at_m, at_m}});
}

TEST_CASE("Device and arm under a constant force move as a damped oscillator does") {
  PlantSettings s = bare();
  s.period_s = 7e-3;  // coarse on purpose: the motion is exact at any period
  s.watchdog_s = 1e9;
  VirtualPlant plant(s, still());
  const double mass = s.mass_kg + s.arm.mass_kg;
  const double damping = s.damping_N_s_per_m + s.arm.damping_N_s_per_m;
  const double stiffness = s.arm.stiffness_N_per_m, force = 0.7;
  const double decay = damping / (2.0 * mass);
  const double omega = std::sqrt(stiffness / mass - decay * decay);
  (void)plant.command({force, 0.0, 0.0});
  for (int i = 1; i <= 100; ++i) {
    plant.advance();
    const double t = static_cast<double>(i) * s.period_s;
    const double expected =
        force / stiffness *
        (1.0 - std::exp(-decay * t) * (std::cos(omega * t) + decay / omega * std::sin(omega * t)));
    REQUIRE_THAT(plant.position_m().x(), WithinAbs(expected, 1e-13));
  }
}

TEST_CASE("A hand that moves at constant speed against friction lags by friction over stiffness") {
  PlantSettings s = bare();
  s.watchdog_s = 1e9;
  constexpr double kSpeed = 0.01;
  VirtualPlant plant(s, OperatorScript({{OperatorPiece::Aim::place, 100.0, 0.0, 100.0 * kSpeed}}));
  for (int i = 0; i < 5000; ++i) plant.advance();
  const double lag = kSpeed * plant.time_s() - plant.position_m().x();
  CHECK_THAT(lag, WithinRel(s.damping_N_s_per_m * kSpeed / s.arm.stiffness_N_per_m, 1e-6));
}

TEST_CASE("A hand that slides across its push lags as it does along it") {
  PlantSettings s = bare();
  s.watchdog_s = 1e9;
  constexpr double kSpeed = 0.01;
  OperatorPiece slide{OperatorPiece::Aim::place, 100.0, 2e-3, 2e-3};
  slide.across_to_m = {0.0, 0.0, 100.0 * kSpeed};
  VirtualPlant plant(s, OperatorScript({slide}));
  for (int i = 0; i < 5000; ++i) plant.advance();
  const double lag = kSpeed * plant.time_s() - plant.position_m().z();
  CHECK_THAT(lag, WithinRel(s.damping_N_s_per_m * kSpeed / s.arm.stiffness_N_per_m, 1e-6));
  CHECK_THAT(plant.position_m().x(), WithinAbs(2e-3, 1e-12));
  CHECK(plant.position_m().y() == 0.0);
}

TEST_CASE("A pushing hand reaches the speed at which friction takes all of its force") {
  PlantSettings s = bare();
  s.watchdog_s = 1e9;
  VirtualPlant plant(s, OperatorScript({{OperatorPiece::Aim::force, 1e9, 0.1, 0.1}}));
  for (int i = 0; i < 5000; ++i) plant.advance();
  CHECK_THAT(plant.velocity_m_per_s().x(),
             WithinRel(0.1 / (s.damping_N_s_per_m + s.arm.damping_N_s_per_m), 1e-9));
}

TEST_CASE("A command takes effect after the delay, not before") {
  PlantSettings s = bare();
  s.delay_periods = 3;
  VirtualPlant plant(s, still());
  for (int i = 0; i < 4; ++i) {
    (void)plant.command({1.0, 0.0, 0.0});
    CHECK(plant.position_m().x() == 0.0);
    plant.advance();
  }
  CHECK(plant.position_m().x() > 0.0);
}

TEST_CASE("Positions come in steps of the encoder") {
  PlantSettings s = bare();
  s.encoder_step_m = 1e-5;
  VirtualPlant plant(s, still(1.2345678e-3));
  CHECK_THAT(plant.measured_m().x(), WithinAbs(1.23e-3, 1e-15));
}

TEST_CASE("The simulated device clips, watches for commands and for speed, and says so") {
  PlantSettings s = bare();
  VirtualOmega7 device(s, still());
  CHECK_FALSE(device.open().hardware);
  CHECK(device.open().assumptions.size() >= 6);
  DevicePreparation preparation;
  preparation.watchdog_s = 0.004;
  device.prepare(preparation);
  device.enable_forces();
  CHECK(device.write({13.0, 0.0, 0.0}) == DeviceAnswer::saturated);
  CHECK(device.write({1.0, 0.0, 0.0}) == DeviceAnswer::ok);
  CHECK(device.status().saturations == 1);
  for (int i = 0; i < 4; ++i) device.advance(1e-3);
  CHECK(device.status().forces_off == ForcesOff::none);
  device.advance(1e-3);
  CHECK(device.status().forces_off == ForcesOff::watchdog);

  device.prepare(preparation);
  device.enable_forces();
  for (int i = 0; i < 2000 && device.status().forces_off == ForcesOff::none; ++i) {
    (void)device.write({12.0 * std::sin(12.0 * 1e-3 * i), 0.0, 0.0});
    device.advance(1e-3);
  }
  CHECK(device.status().forces_off == ForcesOff::none);  // an arm holds it
  s.velocity_limit_m_per_s = 0.1;
  VirtualOmega7 fast(s, still());
  fast.prepare(preparation);
  fast.enable_forces();
  for (int i = 0; i < 100; ++i) {
    (void)fast.write({12.0, 0.0, 0.0});
    fast.advance(1e-3);
  }
  CHECK(fast.status().forces_off == ForcesOff::velocity);
}

/// An Omega.7 that nobody holds, pushed for a number of periods; the largest distances from the x
/// axis and along it, m.
struct FarthestPush {
  explicit FarthestPush(const PlantSettings& settings) : device(settings, still()) {
    (void)device.open();
    device.prepare({});
    device.enable_forces();
  }
  void push(const Eigen::Vector3d& force_N, int periods) {
    for (int i = 0; i < periods; ++i) {
      (void)device.write(force_N);
      device.advance(1e-3);
      (void)device.read(at_m);
      along_m = std::max(along_m, std::abs(at_m.x()));
      around_m = std::max(around_m, std::hypot(at_m.y(), at_m.z()));
    }
  }
  VirtualOmega7 device;
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();
  double along_m = 0.0, around_m = 0.0;
};

TEST_CASE("The handle of the simulated Omega.7 stops at the end of its workspace, and comes back") {
  PlantSettings loose = bare();
  loose.arm = {0.0, 0.0, 0.0, 0.0};
  loose.push = GENERATE(Eigen::Vector3d(Eigen::Vector3d::UnitX()),
                        Eigen::Vector3d(-Eigen::Vector3d::UnitZ()),
                        Eigen::Vector3d(Eigen::Vector3d(1.0, 2.0, -2.0) / 3.0));
  CAPTURE(loose.push.transpose());
  const double half_step_m = 0.51e-5;  // of the encoder
  const auto [radius_m, half_length_m] = kOmega7Workspace;
  {
    FarthestPush pushed(loose);
    pushed.push({0.5, 0.0, 0.0}, 5000);  // 0.5 N on 0.3 kg: 55 mm are behind it after 0.26 s
    CHECK_THAT(pushed.at_m.x(), WithinAbs(half_length_m, half_step_m));
    CHECK(pushed.along_m <= half_length_m + half_step_m);
    CHECK(pushed.around_m <= half_step_m);
    pushed.push({0.0, 0.5, 0.0}, 200);  // it slides along the stop ...
    CHECK_THAT(pushed.at_m.x(), WithinAbs(half_length_m, half_step_m));
    CHECK(pushed.at_m.y() > 0.02);
    pushed.push({-0.5, 0.0, 0.0}, 200);  // ... and nothing keeps it there
    CHECK(pushed.at_m.x() < 0.04);
    CHECK(pushed.device.status().forces_off == ForcesOff::none);
  }
  FarthestPush pushed(loose);
  pushed.push({0.0, 0.3, -0.4}, 5000);
  CHECK_THAT(pushed.at_m.y(), WithinAbs(0.6 * radius_m, half_step_m));
  CHECK_THAT(pushed.at_m.z(), WithinAbs(-0.8 * radius_m, half_step_m));
  pushed.push({-0.5, 0.0, 0.0}, 2000);  // into the edge
  CHECK_THAT(pushed.at_m.x(), WithinAbs(-half_length_m, half_step_m));
  CHECK(pushed.around_m <= radius_m + 2.0 * half_step_m);
}

TEST_CASE("A hand that wants a place beyond the stop does not push harder and harder") {
  PlantSettings s = bare();
  s.arm.correction_per_s = 3.0;
  constexpr double kWanted_m = 0.070, kLong_s = 20.0;
  OperatorPiece far{OperatorPiece::Aim::place, kLong_s, kWanted_m, kWanted_m};
  OperatorPiece back{OperatorPiece::Aim::place, 1.0, 0.0, 0.0};
  VirtualOmega7 device(s, OperatorScript({far, back}));
  CHECK_THAT(device.open().assumptions.back().text,
             Catch::Contains("0.16 m diameter and 0.11 m length"));
  device.prepare({});
  device.enable_forces();
  Eigen::Vector3d at_m;
  const auto live = [&](double seconds) {
    for (int i = 0; i < static_cast<int>(std::lround(seconds / 1e-3)); ++i) {
      (void)device.write(Eigen::Vector3d::Zero());
      device.advance(1e-3);
    }
    (void)device.read(at_m);
  };
  live(kLong_s);
  CHECK_THAT(at_m.x(), WithinAbs(kOmega7Workspace.half_length_m, 1e-5));
  live(0.5);  // as quickly as from 55 mm, had there been no stop
  CHECK(at_m.x() < 0.03);
}

TEST_CASE("A simulated watchdog can be told to forgive, and names that among its assumptions") {
  PlantSettings s = bare();
  s.least_watchdog_s = 0.01;
  VirtualOmega7 device(s, still());
  CHECK(device.open().assumptions.back().code == "least_watchdog");
  DevicePreparation preparation;
  preparation.watchdog_s = 0.004;
  device.prepare(preparation);
  device.enable_forces();
  CHECK(device.write({1.0, 0.0, 0.0}) == DeviceAnswer::ok);
  for (int i = 0; i < 10; ++i) device.advance(1e-3);
  CHECK(device.status().forces_off == ForcesOff::none);
  device.advance(1e-3);
  CHECK(device.status().forces_off == ForcesOff::watchdog);
}

TEST_CASE("An operator script reads back as it was written") {
  const OperatorScript script(
      {{OperatorPiece::Aim::place, 0.1, -0.002, 1.0 / 3.0},
       {OperatorPiece::Aim::force, 0.7, 0.0, 0.196, {0.0, 0.5, 0.0}, {0.0, 0.5, -2.0}}});
  CHECK(to_lines(script) ==
        "place 0.10000000000000001 -0.002 0.33333333333333331 0 0 0 0 0 0\n"
        "force 0.69999999999999996 0 0.19600000000000001 0 0.5 0 0 0.5 -2\n");
}

TEST_CASE("A replay gives its motion and then ends") {
  Eigen::Matrix3Xd motion(3, 2);
  motion << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
  ReplayDevice device(motion, "a.tpmrec");
  CHECK_FALSE(device.open().hardware);
  Eigen::Vector3d at;
  CHECK(device.read(at) == DeviceAnswer::ok);
  CHECK(device.read(at) == DeviceAnswer::ok);
  CHECK(at == Eigen::Vector3d(2.0, 4.0, 6.0));
  CHECK(device.read(at) == DeviceAnswer::finished);
  CHECK_THROWS_AS(ReplayDevice(Eigen::Matrix3Xd(3, 0), "empty.tpmrec"), Error);
}

}  // namespace
}  // namespace tpm::haptics
