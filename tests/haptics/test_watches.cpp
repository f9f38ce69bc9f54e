// Watches of energy and oscillation, slips and damping, gaps that are made up for, and the row of
// the end.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

#include "hil_scenes.hpp"
#include "late_hand.hpp"
#include "shaken_contact.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/haptics/loop/empty_space.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::WithinRel;
using test::guarded;
using test::Puppet;
using test::spring_of;

// --- the energy watch -----------------------------------------------------------------------

TEST_CASE("An honest release gives the hand what the tissue stored, and no more") {
  // A spring of 151 N/m pushed to 8 mm over 2 s stores 4.8 mJ; all of it comes back within 40 ms.
  EnergyWatch watch({.friction_N_s_per_m = 0.0});
  const double k = 151.0;
  double at = 0.0;
  const auto move = [&](double to) {
    const double now = k * to;
    watch.observe({0.0, 0.0, -k * at}, {0.0, 0.0, to - at}, 0.5 * (k * at + now) * (to - at), 1);
    at = to;
  };
  for (int i = 1; i <= 2000; ++i) move(4e-6 * i);
  const double in = watch.delivered_J();
  for (int i = 1; i <= 40; ++i) move(8e-3 - 2e-4 * i);
  // What is left is the leak, K dx^2 / 2 a period: 0.12 mJ of 4.8.
  const double leak = 40 * 0.5 * k * 2e-4 * 2e-4;
  CHECK_THAT(watch.delivered_J() - in, WithinRel(leak, 1e-9));
  CHECK_FALSE(watch.too_much());
  CHECK(watch.tissue_J() < 1e-12);
}

TEST_CASE("Energy put in earlier is no credit for what is given away later") {
  EnergyWatch watch({.friction_N_s_per_m = 0.0, .allowance_J = 2e-3});
  // A damper takes 50 mJ of the hand, then a spring of a force that comes a quarter late gives.
  for (int i = 0; i < 1000; ++i) watch.observe({0.0, 0.0, -1.0}, {0.0, 0.0, 5e-5}, 0.0, 1);
  CHECK(watch.delivered_J() == 0.0);
  double given = 0.0;
  for (int periods = 0; !watch.too_much() && periods < 1000; ++periods) {
    watch.observe({0.0, 0.0, 1.0}, {0.0, 0.0, 5e-5}, 0.0, 1);
    given += 5e-5;
  }
  CHECK(given <= 2e-3 + 5e-5 + 1e-12);  // what was allowed, and one period more
  CHECK_THAT(watch.delivered_J(), WithinRel(given, 1e-9));
}

TEST_CASE("A known delay is a part of what is watched, an unknown one is not seen") {
  const auto most_delivered_J = [](int known) {
    constexpr int kTrue = 20;
    EnergyWatch watch({.friction_N_s_per_m = 0.1, .delay_periods = known});
    double before = 0.0;
    for (int i = 1; i <= 2000; ++i) {
      const double at = 1e-3 * std::sin(2.0 * M_PI * 5.0 * 1e-3 * i);
      const double k = 500.0;
      watch.observe({0.0, 0.0, -k * before}, {0.0, 0.0, at - before},
                    0.5 * k * (at + before) * (at - before), 1);
      before = at;
    }
    (void)kTrue;
    return watch.most_delivered_J();
  };
  CHECK(most_delivered_J(0) < 0.1e-3);
  // A spring late by t under a sine: pi K a^2 sin(w t) a cycle, 20 ms late 0.92 mJ, 5 cycles a s.
  CHECK(most_delivered_J(20) > 2e-3);
}

TEST_CASE("A tissue that gives more than it got is found as well") {
  EnergyWatch watch({.friction_N_s_per_m = 0.1, .allowance_J = 1e-3});
  for (int i = 0; i < 100; ++i) watch.observe({0.0, 0.0, -1.0}, {0.0, 0.0, -2e-5}, -2e-5, 1);
  CHECK(watch.tissue_J() < -1e-3);
  CHECK(watch.too_much());
}

// --- the oscillation watch ------------------------------------------------------------------

bool taken_for_oscillation(const std::function<double(double)>& force_N, double seconds) {
  OscillationWatch watch{OscillationWatchSettings{}};
  for (int i = 0; i < static_cast<int>(1e3 * seconds); ++i) watch.observe(force_N(1e-3 * i), 1);
  return watch.found();
}

TEST_CASE("A steady oscillation is found, at 5 Hz and at 200; a poke, a hold and a decay are not") {
  const auto sine = [](double hertz, double size) {
    return [=](double t) { return 1.0 + size * std::sin(2.0 * M_PI * hertz * t); };
  };
  for (const double hertz : {5.0, 12.0, 40.0, 120.0, 200.0}) {
    CAPTURE(hertz);
    CHECK(taken_for_oscillation(sine(hertz, 0.3), 3.5));
    CHECK_FALSE(taken_for_oscillation(sine(hertz, 0.1), 30.0));  // not felt as more than noise
  }
  CHECK_FALSE(taken_for_oscillation(sine(2.0, 2.0), 60.0));  // an operator who rocks
  // Knocked: rings at 20 Hz and dies out.
  CHECK_FALSE(taken_for_oscillation(
      [](double t) { return 4.0 * std::exp(-6.0 * t) * std::sin(2.0 * M_PI * 20.0 * t); }, 5.0));
}

TEST_CASE("An oscillation is seen by growth and rate, also if no two peaks are equal") {
  // Grows from 0.05 N by 10 % a stroke at 8 Hz.
  CHECK(taken_for_oscillation(
      [](double t) { return 1.0 + 0.05 * std::exp(1.6 * t) * std::sin(2.0 * M_PI * 8.0 * t); },
      3.0));
  // A limit cycle whose peaks change by half from one to the next.
  CHECK(taken_for_oscillation(
      [](double t) {
        return 1.0 + (0.6 + 0.3 * std::sin(2.0 * M_PI * 3.1 * t)) * std::sin(2.0 * M_PI * 12.0 * t);
      },
      3.0));
  // A hand that goes in and out ever deeper, slower than 4 Hz.
  CHECK_FALSE(taken_for_oscillation(
      [](double t) { return 0.1 * std::exp(t) * (1.0 + std::sin(2.0 * M_PI * 2.0 * t)); }, 4.0));
}

// --- the slip element -----------------------------------------------------------------------

TEST_CASE("A slip takes energy and never gives any: a stiff spring, limits that act, random ways") {
  // The tissue is a pure spring: whatever the hand gets back beyond the leak of the held force,
  // which friction above the boundary takes up, would come from the slip.
  Random random(3);
  for (int way = 0; way < 20; ++way) {
    ElementContact model = spring_of(2000.0);
    Puppet device;
    ServoSettings settings = guarded();
    settings.force_limit_N = 0.5 + 4.0 * random.uniform();
    settings.slew_limit_N_per_s = 5.0 + 400.0 * random.uniform();
    settings.friction_N_s_per_m = 0.0;
    settings.energy_allowance_J = std::numeric_limits<double>::infinity();
    settings.watch_oscillation = false;
    ServoStep step(device, model, settings);
    ServoRecord row;
    double speed = 0.0, target = 0.0, work = 0.0, least = 0.0, before = 0.0, force = 0.0;
    for (int i = 0; i < 100'000; ++i) {
      if (i % 100 == 0) target = -2e-3 + 10e-3 * random.uniform();
      speed += 0.05 * ((target - device.at.z()) / 0.02 - speed);
      before = device.at.z();
      device.at.z() += 1e-3 * speed;
      const double moved = device.at.z() - before;
      REQUIRE(step.cycle(0, row) == StopCause::none);
      const double now = -device.force.z();
      work += 0.5 * (force + now) * moved;  // the force taken as linear within a period: no leak
      force = now;
      least = std::min(least, work);
    }
    CAPTURE(way, settings.force_limit_N, settings.slew_limit_N_per_s, least);
    CHECK(step.counts().slipped + step.counts().force_limited > 100);
    CHECK(work > 1e-3);
    CHECK(least > -1e-4);
  }
}

TEST_CASE("Damping never pulls the hand, and rises no faster than a force may") {
  // A loop that gives energy away by its delay, which the controller takes back.
  test::LateHandSettings hand;
  hand.stiffness_N_per_m = 300.0;
  hand.delay_s = 5e-3;
  test::LateHand device(hand);
  test::LinearSpring spring(600.0, 1e-3);
  ServoSettings settings = guarded(5000);
  settings.friction_N_s_per_m = 0.0;
  settings.delay_periods = 5;
  settings.most_damping_N_s_per_m = 30.0;
  settings.energy_allowance_J = 1.0e-2;
  settings.watch_oscillation = false;
  ServoStep step(device, spring, settings);
  ServoRecord row;
  double before_N = 0.0;
  int damped = 0;
  while (step.cycle(0, row) == StopCause::none) {
    device.advance(1e-3);
    const double push_N = -row.commanded_N[2];
    damped += (row.flags & kDamped) != 0 ? 1 : 0;
    REQUIRE(push_N >= 0.0);
    REQUIRE(push_N <= before_N + 400.0 * 1e-3 + 1e-9);
    before_N = push_N;
  }
  CHECK(damped > 10);
}

// --- catching up ----------------------------------------------------------------------------

/// Counts its steps.
class Counting final : public EmptySpace {
 public:
  ContactAnswer step(const ToolPose&) noexcept override {
    ++steps;
    return {};
  }
  int steps = 0;
};

TEST_CASE("A gap of 50 periods is made up for in cycles of eight steps at most") {
  Counting model;
  Puppet device;
  ServoStep step(device, model, guarded());
  ServoRecord row;
  (void)step.cycle(0, row);
  int cycles = 0, most = 0, before = model.steps;
  CHECK(step.cycle(50, row) == StopCause::none);
  for (; cycles < 20; ++cycles) {
    most = std::max(most, model.steps - before);
    before = model.steps;
    (void)step.cycle(0, row);
  }
  CHECK(most == ServoStep::kMostSteps);
  CHECK(static_cast<std::uint64_t>(model.steps) == step.cycles());
}

// --- the last row ---------------------------------------------------------------------------

TEST_CASE("The row of the end holds what was known last, and no command") {
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  (void)run_session(test::parsed(test::short_session()), {}, options);
  const HilRecording recording = read_recording(folder / "r");
  const ServoRecord& last = recording.rows.back();
  const ServoRecord& before = recording.rows[recording.rows.size() - 2];
  CHECK(last.stop == StopCause::finished);
  CHECK(last.position_m[2] == before.position_m[2]);
  CHECK(last.tool_depth_m == before.tool_depth_m);
  CHECK(last.observed_J == before.observed_J);
  CHECK(last.commanded_N[2] == 0.0);
  CHECK(last.tool_depth_m < -1e-3);
}

}  // namespace
}  // namespace tpm::haptics
