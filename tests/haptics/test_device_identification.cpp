// tpm hil identify finds what was put into a device, without being told.
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "hil_scenes.hpp"
#include "identified_handle.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/session/identify_run.hpp"
#include "tpm/haptics/session/six_hands.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

using test::Handle;
using test::moved;

TEST_CASE("A second is enough for the delay to half a period, with and without a hand") {
  for (const double late_s : {0.0, 2.5e-3, 10e-3}) {
    for (const bool held : {false, true}) {
      for (const bool positions : {false, true}) {
        test::Handle h;
        (positions ? h.position_late_s : h.force_late_s) = late_s;
        if (held) {
          h.mass_kg = 0.85;
          h.viscous_N_s_per_m = 6.5;
          h.held_N_per_m = 135.0;
        }
        std::vector<IdentificationSample> samples = test::moved(h);
        samples.resize(1000);
        const std::optional<double> delay_s = checked_delay_s(samples, h.period_s);
        CAPTURE(late_s, held, positions);
        REQUIRE(delay_s);
        CHECK(std::abs(*delay_s - late_s) <= 0.5 * h.period_s);
      }
    }
  }
  // One that something else holds still.
  test::Handle stuck;
  stuck.held_N_per_m = 1e5;
  std::vector<IdentificationSample> samples = test::moved(stuck);
  samples.resize(1000);
  CHECK_FALSE(checked_delay_s(samples, stuck.period_s));
}

TEST_CASE("The check of a second tells the largest delay that it saw, not the mean") {
  const auto checked_s = [](const Handle& h, std::uint64_t seed) {
    std::vector<IdentificationSample> samples = moved(h, seed);
    samples.resize(1000);
    return checked_delay_s(samples, h.period_s).value();
  };
  Handle grows;
  grows.force_late_s = 1e-3;
  grows.later_s = 2e-3;
  grows.later_from_s = 0.45;
  grows.later_until_s = 0.6;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    CAPTURE(seed);
    CHECK(checked_s(grows, seed) > 2.3e-3);  // for most of the second it is 1 ms
    CHECK(checked_s(grows, seed) < 3.5e-3);
  }
  Handle jitters;
  jitters.force_late_s = 4e-3;
  jitters.jitter_s = 3e-3;
  constexpr int kSeconds = 8;
  double sum_s = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeconds; ++seed) sum_s += checked_s(jitters, seed);
  CHECK(sum_s / kSeconds > 5.6e-3);  // the mean is about 4.9 ms
  CHECK(sum_s / kSeconds < 7.0e-3);
}

TEST_CASE("The check before a session finds the delay of the simulated device") {
  for (const int periods : {0, 3, 10}) {
    HilSession session = test::parsed(test::short_session());
    session.plant.delay_periods = periods;
    session.plant.arm = {1e-9, 0.0, 0.0, 0.0};  // nobody holds it
    const DeviceIdentifyOptions options;
    const DelayCheck check =
        check_delay(make_device(DeviceChoice{}, session), DeviceChoice{}, session, options);
    CAPTURE(periods);
    REQUIRE(check.delay_s);
    CHECK(std::abs(*check.delay_s - periods * session.servo.period_s) <=
          0.5 * session.servo.period_s + 1e-9);
  }
}

TEST_CASE("A delay of 0 to 10 ms on either path is found to half a period") {
  for (const double late_s : {0.0, 1e-3, 2.5e-3, 6.3e-3, 10e-3}) {
    for (const bool of_positions : {false, true}) {
      Handle h;
      (of_positions ? h.position_late_s : h.force_late_s) = late_s;
      const DeviceIdentification found = identify_device(moved(h), h.period_s);
      CAPTURE(late_s, of_positions, found.edges);
      REQUIRE(found.delay_mean_s);
      CHECK_THAT(*found.delay_mean_s, WithinAbs(late_s, 0.5 * h.period_s));
      CHECK_THAT(*found.delay_largest_s, WithinAbs(late_s, h.period_s));
      CHECK(*found.delay_largest_s >= late_s - 1e-4);
    }
  }
}

TEST_CASE("The largest of delays that jitter is found, and their spread") {
  Handle h;
  h.force_late_s = 3e-3;
  h.jitter_s = 1.5e-3;
  const DeviceIdentification found = identify_device(moved(h), h.period_s);
  REQUIRE(found.delay_largest_s);
  CHECK(*found.delay_largest_s > 3.9e-3);
  CHECK(*found.delay_largest_s < 5.5e-3);
  CHECK(*found.delay_jitter_s > 0.4e-3);
}

TEST_CASE("The mass of a free handle is found to 10 %") {
  for (const double mass_kg : {0.2, 0.3, 0.6}) {
    for (const double coulomb_N : {0.0, 0.03}) {
      Handle h;
      h.mass_kg = mass_kg;
      h.coulomb_N = coulomb_N;
      h.force_late_s = 2e-3;
      const DeviceIdentification found = identify_device(moved(h), h.period_s);
      CAPTURE(mass_kg, coulomb_N, found.coulomb_low_N.value_or(-1),
              found.coulomb_high_N.value_or(-1));
      REQUIRE(found.mass_kg);
      CHECK_THAT(*found.mass_kg, WithinRel(mass_kg, 0.1));
      CHECK(found.mass_certain);
      REQUIRE(found.encoder_step_m);
      CHECK_THAT(*found.encoder_step_m, WithinRel(1e-5, 1e-6));
    }
  }
}

TEST_CASE("A handle that is held has an interval of mass and no number") {
  Handle h;
  h.mass_kg = 0.85;
  h.viscous_N_s_per_m = 6.5;
  h.held_N_per_m = 135.0;
  const DeviceIdentification found = identify_device(moved(h), h.period_s);
  REQUIRE(found.mass_kg);
  CHECK_FALSE(found.mass_certain);
  CHECK(*found.mass_low_kg < 0.3);  // of the device alone
  CHECK(*found.mass_high_kg > 0.85);
}

TEST_CASE("The damping of a hand that holds the handle is no friction of the device") {
  for (const SafeHand& hand : kSafeHands) {
    for (const double friction : {0.05, 0.3}) {
      Handle h;
      h.mass_kg = hand.mass_kg;
      h.viscous_N_s_per_m = friction + hand.damping_N_s_per_m;
      h.held_N_per_m = hand.stiffness_N_per_m;
      const DeviceIdentification found = identify_device(moved(h), h.period_s);
      CAPTURE(hand.name, friction, found.held_N_per_m,
              found.viscous_lower_95_N_s_per_m.value_or(-1));
      CHECK_FALSE(found.viscous_lower_95_N_s_per_m);
      CHECK_FALSE(found.viscous_N_s_per_m);
      CHECK_FALSE(found.delay_mean_s);
      CHECK_FALSE(found.coulomb_low_N);
      REQUIRE(found.not_identified.size() == 1);
      CHECK(found.not_identified[0].code == "held");
    }
  }
}

TEST_CASE("A handle that hardly moves is not identified") {
  Handle h;
  h.coulomb_N = 1.0;  // no force of the identification moves it
  const DeviceIdentification found = identify_device(moved(h), h.period_s);
  CHECK_FALSE(found.delay_mean_s);
  CHECK_FALSE(found.viscous_lower_95_N_s_per_m);
  REQUIRE_FALSE(found.not_identified.empty());
}

TEST_CASE("Loops that wake late and miss periods identify the same device, and say what stalled") {
  Handle h;
  h.force_late_s = 3e-3;
  h.coulomb_N = 0.02;
  Handle stalling = h;
  stalling.late_share = 0.3;     // of the cycles wake late by up to a period
  stalling.stall_every_s = 0.1;  // 2 to 7 periods are missed at a time
  stalling.longest_stall_s = 7e-3;
  // A machine that other programs use: nearly no 130 periods follow each other on time.
  const DeviceIdentification found = identify_device(moved(stalling), h.period_s);
  CAPTURE(found.not_identified.empty() ? "" : found.not_identified.front().code);
  REQUIRE(found.delay_mean_s);
  CHECK(found.stalls == 0);
  CHECK_THAT(*found.delay_mean_s, WithinAbs(3e-3, 0.5 * h.period_s));
  CHECK_THAT(*found.delay_largest_s, WithinAbs(3e-3, h.period_s));
  CHECK_THAT(*found.mass_kg, WithinRel(h.mass_kg, 0.1));
  CHECK(*found.viscous_lower_95_N_s_per_m < h.viscous_N_s_per_m);
  CHECK(*found.viscous_lower_95_N_s_per_m > 0.7 * h.viscous_N_s_per_m);
  REQUIRE(checked_delay_s(moved(stalling), h.period_s));
  // Longer stalls are left out.
  stalling.stall_every_s = 0.4;
  stalling.longest_stall_s = 0.05;
  const DeviceIdentification rest = identify_device(moved(stalling), h.period_s);
  REQUIRE(rest.delay_mean_s);
  CHECK(rest.stalls > 20);
  CHECK(rest.stalled_s > 0.5);
  CHECK_THAT(*rest.delay_mean_s, WithinAbs(3e-3, 0.5 * h.period_s));
  CHECK_THAT(*rest.mass_kg, WithinRel(h.mass_kg, 0.1));
  // So many that nothing is left say so.
  stalling.stall_every_s = 0.03;
  const DeviceIdentification nothing = identify_device(moved(stalling), h.period_s);
  CHECK_FALSE(nothing.delay_mean_s);
  REQUIRE_FALSE(nothing.not_identified.empty());
  CHECK(nothing.not_identified.back().code == "stalled");
}

TEST_CASE("Positions that are not counted in steps have no encoder step") {
  Handle h;
  h.encoder_step_m = 1e-12;
  const DeviceIdentification found = identify_device(moved(h), h.period_s);
  CHECK_FALSE(found.encoder_step_m);
  REQUIRE(found.delay_mean_s);
  CHECK_THAT(*found.mass_kg, WithinRel(h.mass_kg, 0.1));
}

TEST_CASE("The simulated device is identified, and its file is one that a session takes") {
  HilSession like = test::parsed(test::short_session());
  like.plant.delay_periods = 4;
  like.plant.mass_kg = 0.4;
  like.plant.damping_N_s_per_m = 0.7;
  like.plant.arm = {1e-9, 0.0, 0.0, 0.0};  // nobody holds it
  DeviceIdentifyOptions options;
  const IdentifyRun run = run_identification({}, like, options);
  CHECK(run.outcome.cause == StopCause::finished);
  REQUIRE(run.found.delay_mean_s);
  CHECK_THAT(*run.found.delay_mean_s, WithinAbs(4e-3, 0.5e-3));
  CHECK_THAT(*run.found.mass_kg, WithinRel(0.4, 0.1));
  CHECK(*run.found.viscous_lower_95_N_s_per_m <= 0.7);
  CHECK(*run.found.viscous_lower_95_N_s_per_m > 0.5);
  const Json written = device_file_json(run, "");
  CHECK(written.at("delay").at("hold") ==
        "the hold of a command, half a period in the mean, is not included");
  const DeviceFile file = parse_device_file(written, "device.json");
  CHECK(file.kind == "virtual");
  REQUIRE(file.measured_delay_s);
  CHECK_THAT(*file.measured_delay_s, WithinAbs(4e-3, 1e-3));
}

}  // namespace
}  // namespace tpm::haptics
