// The gate before a session: six hands, and what counts of a device that nobody has measured.
#include <catch2/catch.hpp>

#include "hil_scenes.hpp"
#include "late_hand.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/session/loop_contact.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/session/six_hands.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinRel;

RenderingCheck checked_on(const Json& json, const DeviceLimits& limits) {
  const HilSession session = test::parsed(json);
  const LoopModel loop = make_loop_model(session);
  return check_rendering(session, *loop.model, loop, limits);
}

DeviceLimits measured_omega(double delay_s, double friction_N_s_per_m) {
  DeviceLimits limits = limits_of("omega7");
  limits.measured_delay_s = delay_s;
  limits.measured_friction_N_s_per_m = friction_N_s_per_m;
  return limits;
}

TEST_CASE("Hardware that nobody has measured counts as 20 ms late and free of friction") {
  const RenderingCheck check = checked_on(test::short_session(), limits_of("omega7"));
  CHECK(check.delay_s == 0.020);
  CHECK(check.friction_N_s_per_m == 0.0);
  CHECK_FALSE(check.delay_measured);
  CHECK_FALSE(check.acceptable());  // the star has 151 N/m
  CHECK_THAT(check.hands_N_per_m, WithinRel(1.0 / 20.5e-3, 1e-9));
  CHECK_THAT(check.verdict(), Contains("not measured on this device") &&
                                  Contains("at most 48.8 N/m keep six hands below 5 mJ") &&
                                  Contains("tpm hil identify"));
  DeviceChoice omega;
  omega.kind = "omega7";
  omega.library = "/no/such.so";
  CHECK_THAT(
      test::refusal_of([&] { (void)run_session(test::parsed(test::short_session()), omega, {}); }),
      Contains("not measured on this device"));
}

TEST_CASE("A measured friction does not count on hardware of which nobody measured the delay") {
  const char* absent = R"({"device": "omega7",
    "viscous_friction": {"provenance": "measured", "lower_95_N_s_per_m": 4.0}})";
  const char* assumed =
      R"({"device": "omega7", "delay": {"provenance": "assumed", "largest_s": 1e-4},
    "viscous_friction": {"provenance": "measured", "lower_95_N_s_per_m": 4.0}})";
  for (const char* text : {absent, assumed}) {
    CAPTURE(text);
    const DeviceLimits limits =
        limits_by_file(limits_of("omega7"), parse_device_file(Json::parse(text), "d"));
    CHECK(limits.measured_friction_N_s_per_m == 4.0);
    RenderingCheck check = checked_on(test::short_session(), limits);
    CHECK(check.delay_s == 0.020);
    CHECK(check.friction_N_s_per_m == 0.0);
    CHECK_FALSE(check.acceptable());
    CHECK_THAT(check.verdict(), Contains("(not measured on this device: 20 ms and no friction "
                                         "count), friction 0 N s/m"));
    // A session that states a longer delay is told what counts then.
    Json json = test::short_session();
    json["virtual_device"] = {{"delay_periods", 30}, {"damping_N_s_per_m", 5.0}};
    check = checked_on(json, limits);
    CHECK(check.friction_N_s_per_m == 0.0);
    CHECK_THAT(check.verdict(), Contains("30 ms and no friction count"));
    // The C interface asks the same gate.
    const test::TempFolder folder;
    write_file(folder / "d.json", text);
    write_file(folder / "s.json", test::short_session().dump());
    LoopContactOptions options;
    options.device_file = folder / "d.json";
    const auto refused = [&] {
      return test::refusal_of([&] { (void)LoopContact(folder / "s.json", options); });
    };
    CHECK_THAT(refused(), Contains("(not measured on this device: 20 ms and no friction count), "
                                   "friction 0 N s/m"));
    options.accept_unstable = true;
    CHECK_THAT(refused(), Contains("accept_unstable: is not for the device 'omega7'"));
    options.device_file.clear();
    for (const char* kind : {"", "omega7", "inverse3"}) {
      CAPTURE(kind);
      options.device = kind;
      CHECK_THAT(refused(), Contains("accept_unstable: is not for the device"));
    }
    options.device = "virtual";
    CHECK_NOTHROW(LoopContact(folder / "s.json", options));
  }
}

TEST_CASE("Of measured hardware the largest delay and a period more count") {
  const RenderingCheck check = checked_on(test::short_session(), measured_omega(1.2e-3, 0.25));
  CHECK_THAT(check.delay_s, WithinRel(2.2e-3, 1e-12));
  CHECK(check.delay_periods == 3);
  CHECK(check.friction_N_s_per_m == 0.25);
  CHECK(check.acceptable());
  CHECK_THAT(check.verdict(), Contains("of six hands stable with: "));
  // What counts is printed, not the whole periods around it.
  CHECK_THAT(check.verdict(), Contains("1000 Hz, 2.2 ms of delay, friction"));
}

TEST_CASE(
    "Hardware with a longer delay than any that was tried is refused, however soft the tissue") {
  Json soft = test::short_session();
  for (const char* key : {"E1", "E2", "Eprime"}) {
    soft["model"]["scene"]["material"][key] = "1 kPa";
  }
  CHECK(checked_on(soft, measured_omega(0.020, 0.25)).acceptable());
  const RenderingCheck check = checked_on(soft, measured_omega(0.0205, 0.25));
  CHECK(check.safe_in_hands());
  CHECK_FALSE(check.acceptable());
  CHECK_THAT(check.verdict(), Contains("the delay is longer than any that is guarded") &&
                                  Contains("measured at most 20 ms"));
  CHECK(to_json(check).at("delay_guarded") == false);
  // The simulated device has the delay that its session states.
  soft["virtual_device"] = {{"delay_periods", 30}};
  CHECK(checked_on(soft, limits_of("virtual")).acceptable());
}

TEST_CASE("A delay that a slower loop measured counts with the period of that loop") {
  DeviceLimits limits = measured_omega(1.2e-3, 0.25);
  limits.measured_period_s = 2e-3;  // known to half of it
  CHECK_THAT(checked_on(test::short_session(), limits).delay_s, WithinRel(3.2e-3, 1e-12));
  limits.measured_period_s = 0.25e-3;
  CHECK_THAT(checked_on(test::short_session(), limits).delay_s, WithinRel(2.2e-3, 1e-12));
}

TEST_CASE("Of what a session states, the larger delay and the smaller friction count") {
  Json json = test::short_session();
  json["virtual_device"] = {{"delay_periods", 4}, {"damping_N_s_per_m", 0.05}};
  RenderingCheck check = checked_on(json, measured_omega(1e-3, 0.25));
  CHECK(check.delay_s == 4e-3);
  CHECK(check.friction_N_s_per_m == 0.05);
  json["virtual_device"] = {{"delay_periods", 1}, {"damping_N_s_per_m", 5.0}};
  check = checked_on(json, measured_omega(1e-3, 0.25));
  CHECK(check.delay_s == 2e-3);
  CHECK(check.friction_N_s_per_m == 0.25);
  check = checked_on(json, limits_of("omega7"));
  CHECK(check.delay_s == 0.020);
  CHECK(check.friction_N_s_per_m == 0.0);
}

TEST_CASE("A device file counts what was measured, and nothing that is assumed") {
  const auto read = [](const char* provenance) {
    return limits_by_file(
        limits_of("omega7"),
        parse_device_file(
            {{"device", "omega7"},
             {"limits", {{"force_N", 3.0}}},
             {"delay", {{"provenance", provenance}, {"largest_s", 0.002}}},
             {"viscous_friction", {{"provenance", provenance}, {"lower_95_N_s_per_m", 0.2}}}},
            "device.json"));
  };
  CHECK(read("measured").measured_delay_s == 0.002);
  CHECK(read("measured").measured_friction_N_s_per_m == 0.2);
  CHECK(read("measured").force_N == 3.0);
  CHECK_FALSE(read("assumed").measured_delay_s.has_value());
  CHECK_FALSE(read("assumed").measured_friction_N_s_per_m.has_value());
  CHECK_THAT(test::refusal_of([] {
               (void)limits_by_file(
                   limits_of("omega7"),
                   parse_device_file({{"device", "omega7"}, {"limits", {{"force_N", 99.0}}}}, "d"));
             }),
             Contains("d: key /limits/force_N: 99; expected at most 12, the limit of 'omega7'"));
}

TEST_CASE("No hand receives 5 mJ from the stiffest spring that the gate lets pass") {
  constexpr double kPeriod_s = 1e-3;
  double most_J = 0.0;
  for (const double delay_s : {0.0, 1e-3, 5e-3, 19e-3}) {
    const double counted_s = delay_s + kPeriod_s;
    const double stiffness = largest_stiffness_for_hands(counted_s, 0.0, kPeriod_s);
    ServoSettings settings;
    settings.friction_N_s_per_m = 0.0;
    settings.delay_periods = static_cast<int>(std::ceil(counted_s / kPeriod_s - 1e-9));
    for (const SafeHand& hand : kSafeHands) {
      for (const double error_s : {-0.5 * kPeriod_s, 0.5 * kPeriod_s}) {
        test::LateHandSettings s;
        s.mass_kg = hand.mass_kg;
        s.damping_N_s_per_m = hand.damping_N_s_per_m;
        s.stiffness_N_per_m = hand.stiffness_N_per_m;
        s.delay_s = std::max(0.0, delay_s + error_s);
        s.jitter_s = 0.5 * kPeriod_s;
        const test::HandRun run = test::run_hand(s, stiffness, settings);
        CAPTURE(delay_s, stiffness, hand.name, error_s, run.most_given_J);
        CHECK(run.most_given_J < kMostIntoHand_J);
        most_J = std::max(most_J, run.most_given_J);
      }
    }
  }
  CHECK(most_J > 0.0);
}

TEST_CASE("A loop that feeds a hand because its delay grew unseen is stopped") {
  // 10 ms late where 1 ms was told: 400 N/m give a light hand 4 N s/m of negative damping.
  ServoSettings settings;
  settings.friction_N_s_per_m = 0.0;
  settings.delay_periods = 1;
  test::LateHandSettings s;
  s.later_s = 10e-3;
  s.grows_at_s = 1.0;
  for (const SafeHand& hand : kSafeHands) {
    s.mass_kg = hand.mass_kg;
    s.damping_N_s_per_m = hand.damping_N_s_per_m;
    s.stiffness_N_per_m = hand.stiffness_N_per_m;
    const test::HandRun run = test::run_hand(s, 400.0, settings);
    const test::HandRun before = test::run_hand(s, 400.0, settings, true);
    CAPTURE(hand.name, 1e3 * run.most_given_J, 1e3 * before.most_given_J, to_string(run.cause));
    CHECK(run.most_given_J < 1.5 * before.most_given_J + 1e-3);
    if (hand.damping_N_s_per_m < 1.0) CHECK(run.cause != StopCause::finished);
  }
}

TEST_CASE(
    "Whatever a delay grows to, forces are off in time and an oracle lets half as much pass") {
  for (const double grown_s : {5e-3, 10e-3, 20e-3}) {
    for (const double stiffness : {100.0, 300.0, 600.0}) {
      for (const SafeHand& hand : kSafeHands) {
        for (const double push_N : {0.2, 1.0}) {
          ServoSettings settings;
          settings.friction_N_s_per_m = 0.0;
          settings.delay_periods = 1;
          test::LateHandSettings s;
          s.mass_kg = hand.mass_kg;
          s.damping_N_s_per_m = hand.damping_N_s_per_m;
          s.stiffness_N_per_m = hand.stiffness_N_per_m;
          s.push_N = push_N;
          s.later_s = grown_s;
          s.grows_at_s = 1.0;
          const test::HandRun run = test::run_hand(s, stiffness, settings);
          if (run.first_2_mJ_s < 0.0) continue;
          const test::HandRun oracle = test::run_hand(s, stiffness, settings, true);
          CAPTURE(grown_s, stiffness, hand.name, push_N, to_string(run.cause));
          CHECK(run.off_s - run.first_2_mJ_s <= 3.0 * grown_s + 0.02 + 1e-9);
          CHECK(run.most_given_J <= 1.5 * oracle.most_given_J + 1e-3);
        }
      }
    }
  }
}

TEST_CASE(
    "Where the friction of the device makes a rendering passive, a delay that grows is found") {
  // Just passive at the delay told; 20 ms late from 1 s on. Earlier joules reached a hand.
  for (const double stiffness : {200.0, 1000.0, 4000.0}) {
    for (const SafeHand& hand : kSafeHands) {
      ServoSettings settings;
      settings.delay_periods = 1;
      settings.friction_N_s_per_m = 1.0001 * stiffness * 1.5e-3;
      test::LateHandSettings s;
      s.mass_kg = hand.mass_kg;
      s.damping_N_s_per_m = hand.damping_N_s_per_m;
      s.stiffness_N_per_m = hand.stiffness_N_per_m;
      s.friction_N_s_per_m = settings.friction_N_s_per_m;
      s.push_N = 1.0;
      CAPTURE(stiffness, hand.name);
      CHECK(test::run_hand(s, stiffness, settings).cause == StopCause::finished);
      s.later_s = 20e-3;
      s.grows_at_s = 1.0;
      const test::HandRun run = test::run_hand(s, stiffness, settings);
      CAPTURE(run.most_given_J, to_string(run.cause));
      CHECK(run.most_given_J < 0.15);
      const double fed = stiffness * 20e-3 - settings.friction_N_s_per_m;
      if (hand.damping_N_s_per_m < 0.3 * fed) CHECK(run.cause == StopCause::oscillation);
    }
  }
}

TEST_CASE("Slow indentations of a rendering that is not passive come to their end") {
  // 8 mm at 10 mm/s into 170 N/m, 2 ms told, in the published hand.
  ServoSettings settings;
  settings.friction_N_s_per_m = 0.0;
  settings.delay_periods = 2;
  test::LateHandSettings s;
  const SafeHand& hand = kSafeHands.back();
  s.mass_kg = hand.mass_kg;
  s.damping_N_s_per_m = hand.damping_N_s_per_m;
  s.stiffness_N_per_m = hand.stiffness_N_per_m;
  s.delay_s = 1e-3;
  s.push_N = 0.6;
  CHECK(test::run_hand(s, 170.0, settings).cause == StopCause::finished);
}

TEST_CASE("A rendering that needs damping all the time is ended with that cause") {
  ServoSettings settings;
  settings.friction_N_s_per_m = 0.0;
  settings.delay_periods = 10;
  settings.energy_allowance_J = 1.0;  // nothing else ends it
  test::LateHandSettings s;
  s.delay_s = 10e-3;
  s.stiffness_N_per_m = 300.0;
  s.damping_N_s_per_m = 2.0;
  CHECK(test::run_hand(s, 60.0, settings).cause == StopCause::finished);
  settings.energy_allowance_J = 1e-2;
  s.damping_N_s_per_m = 0.5;
  const test::HandRun run = test::run_hand(s, 300.0, settings);
  CHECK((run.cause == StopCause::damping || run.cause == StopCause::oscillation));
}

}  // namespace
}  // namespace tpm::haptics
