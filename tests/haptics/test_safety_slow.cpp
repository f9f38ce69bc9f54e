// Random motions of passive set-ups, none of which may be stopped. A million of them:
// measure_late_twins, whose page is reports/haptics/report.md.
#include <algorithm>
#include <catch2/catch.hpp>

#include "random_ways.hpp"
#include "tpm/haptics/loop/servo_step.hpp"

namespace tpm::haptics {
namespace {

TEST_CASE("No motion of 60,000 of passive set-ups is stopped") {
  constexpr int kSetUps = 1000, kWays = 60;
  Random random(2024);
  double most_delivered_J = 0.0;
  for (int i = 0; i < kSetUps; ++i) {
    const test::PassiveSetUp s = test::next_passive_set_up(random, i, kWays);
    ElementContact model(s.tissue, s.servo.period_s);
    VirtualOmega7 device(s.plant, s.script);
    (void)device.open();
    device.prepare({});
    device.enable_forces();
    ServoStep step(device, model, s.servo);
    ServoRecord row;
    StopCause cause = StopCause::none;
    while (cause == StopCause::none) {
      cause = step.cycle(0, row);
      device.advance(s.servo.period_s);
    }
    const double delivered_J = step.energy().most_delivered_J();
    most_delivered_J = std::max(most_delivered_J, delivered_J);
    CAPTURE(i, s.servo.period_s, s.stiffness_N_per_m, s.plant.damping_N_s_per_m,
            s.relaxation_time_s, delivered_J, row.cycle);
    INFO(to_string(cause));
    REQUIRE(cause == StopCause::finished);
  }
  WARN("largest energy given: " << 1e3 * most_delivered_J << " mJ of the 2 mJ that stop a session");
  CHECK(most_delivered_J < 2e-3);
}

}  // namespace
}  // namespace tpm::haptics
