// A delay that has grown, found by how the hand moves.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <deque>
#include <string>

#include "hil_scenes.hpp"
#include "tpm/haptics/device/device_limits.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/delay_watch.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/session/surface_scene.hpp"

namespace tpm::haptics {
namespace {

/// A mass on a spring towards a place, with a damper, and a spring that answers so much later.
struct LateSpring {
  double mass_kg = 0.4, damping_N_s_per_m = 1.0, hand_N_per_m = 50.0, stiffness_N_per_m = 600.0;
  double delay_s = 0.0, at_m = 1e-3, speed_m_per_s = 0.0;
};

/// Largest sign that a watch which was told 1 ms sees within so long.
double largest_sign(LateSpring s, double time_s, double encoder_step_m = 1e-5) {
  constexpr double kPeriod_s = 1e-3;
  constexpr int kParts = 20;
  DelayWatch watch({.period_s = kPeriod_s, .told_s = 1e-3});
  std::deque<double> coming(static_cast<std::size_t>(std::lround(s.delay_s / kPeriod_s)), 0.0);
  double largest = 0.0, sent_N = 0.0;
  for (int i = 0; i < static_cast<int>(time_s / kPeriod_s); ++i) {
    const double seen_m = encoder_step_m * std::round(s.at_m / encoder_step_m);
    watch.observe(seen_m, sent_N, 1);
    largest = std::max(largest, watch.sign());
    sent_N = -s.stiffness_N_per_m * seen_m;
    coming.push_back(sent_N);
    const double force_N = coming.front();
    coming.pop_front();
    for (int part = 0; part < kParts; ++part) {
      const double a =
          (force_N - s.damping_N_s_per_m * s.speed_m_per_s - s.hand_N_per_m * s.at_m) / s.mass_kg;
      s.speed_m_per_s += a * kPeriod_s / kParts;
      s.at_m += s.speed_m_per_s * kPeriod_s / kParts;
    }
  }
  return largest;
}

TEST_CASE(
    "A loop that feeds itself because its forces are late is found, and one that dies out not") {
  // It feeds with K d = 6 and 12 N s/m what takes up 1 N s/m.
  for (const double delay_s : {0.010, 0.020}) {
    LateSpring late;
    late.delay_s = delay_s;
    CAPTURE(delay_s);
    CHECK(largest_sign(late, 1.0) > 1.0);
  }
  // As told: 600 N/m over 1.5 ms feed less than is taken up.
  LateSpring told;
  told.delay_s = 0.001;
  CHECK(largest_sign(told, 1.0) < 0.5);
  told.damping_N_s_per_m = 5.0;
  CHECK(largest_sign(told, 1.0) < 0.5);
  // Later than told, in a hand that takes up more.
  LateSpring heavy;
  heavy.delay_s = 0.005;
  heavy.damping_N_s_per_m = 6.0;
  CHECK(largest_sign(heavy, 1.0) < 1.0);
}

TEST_CASE("A hand at rest, and one that moves evenly, say nothing of the delay") {
  DelayWatch watch({.period_s = 1e-3, .told_s = 1e-3});
  for (int i = 0; i < 2000; ++i) {
    watch.observe(1e-5 * std::round(1e5 * (i < 1000 ? 0.0 : 1e-5 * (i - 1000))), 0.0, 1);
    REQUIRE(watch.sign() < 1.0);
  }
}

TEST_CASE("Missed periods are lived through") {
  DelayWatch watch({.period_s = 1e-3, .told_s = 1e-3});
  for (int i = 0; i < 200; ++i) watch.observe(1e-3 * std::sin(0.1 * i), 0.1, 1 + i % 5);
  CHECK(std::isfinite(watch.sign()));
}

/// What a session announces on a device, and whether its loop looks at the motion.
struct Announced {
  RenderingCheck rendering;
  bool looks = false;
};

Announced announced(const HilSession& session, const DeviceLimits& limits) {
  const LoopModel loop = make_loop_model(session);
  Announced a;
  a.rendering = check_rendering(session, *loop.model, loop, limits);
  VirtualOmega7 device(session.plant, session.operator_script());
  device.prepare(session.preparation);
  a.looks =
      ServoStep(device, *loop.model, loop_settings(session, loop, a.rendering, true)).passive();
  return a;
}

TEST_CASE("A loop looks for a delay that grows exactly where its rendering is announced passive",
          "[heavy]") {
  // The shipped sessions whose models are made within a second, all passive by their friction.
  for (const char* name : {"law", "liver", "network", "omega7", "surface"}) {
    const std::string file = fmt::format(TPM_TEST_SOURCE_DIR "/configs/hil_{}.json", name);
    HilSession session = read_session(file);
    follow_surface(session);
    CAPTURE(name);
    const Announced shipped = announced(session, limits_of("virtual"));
    CHECK(shipped.rendering.passive());
    CHECK(shipped.looks);
    session.plant.damping_N_s_per_m = 0.02;
    const Announced slippery = announced(session, limits_of("virtual"));
    CHECK_FALSE(slippery.rendering.passive());
    CHECK_FALSE(slippery.looks);
  }
  // A star that is passive at rest, and stiffer where the session goes.
  HilSession star = test::parsed(test::short_session());
  const LoopModel loop = make_loop_model(star);
  const double at_rest = loop.push.dot(loop.model->instantaneous_stiffness() * loop.push);
  const RenderingCheck there = check_rendering(star, *loop.model, loop, "virtual");
  REQUIRE(there.stiffness_N_per_m > 1.01 * at_rest);
  star.plant.damping_N_s_per_m =
      0.5 * (there.stiffness_N_per_m + at_rest) * 0.5 * star.servo.period_s;
  const Announced stiffer = announced(star, limits_of("virtual"));
  CHECK_FALSE(stiffer.rendering.passive());
  CHECK_FALSE(stiffer.looks);
  // Hardware whose delay is no whole number of periods: 1.2 + 1 ms are passive, 3 periods not.
  DeviceLimits limits = limits_of("omega7");
  limits.measured_delay_s = 1.2e-3;
  limits.measured_friction_N_s_per_m = there.stiffness_N_per_m * (0.5e-3 + 2.4e-3);
  star.plant.delay_periods = 0;
  const Announced measured = announced(star, limits);
  CHECK(measured.rendering.delay_periods == 3);
  CHECK(measured.rendering.passive());
  CHECK(measured.looks);
}

}  // namespace
}  // namespace tpm::haptics
