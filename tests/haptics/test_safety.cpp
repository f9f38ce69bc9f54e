// What must not reach the hand: instability, a start inside the tissue, limits without ceilings.
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "hil_scenes.hpp"
#include "shaken_contact.hpp"
#include "temp_folder.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/session/live_view.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::element_of;
using test::guarded;
using test::Puppet;

// --- sessions -------------------------------------------------------------------------------

Json stiff_session(const char* modulus, int delay = 0) {
  Json json = test::with(test::short_session(), "/model/scene/material/E1", modulus);
  json["model"]["scene"]["material"]["E2"] = modulus;
  json.erase("creep");
  json["virtual_device"]["delay_periods"] = delay;
  return json;
}

/// On a simulated Omega.7 whose gate has no ceiling of the stiffness, and takes its encoder for
/// exact.
SessionRun run_without_ceilings(const HilSession& session, const SessionRunOptions& options) {
  DeviceLimits limits = limits_of("virtual");
  limits.stiffness_N_per_m = 1e12;  // stiffer than any tissue here
  limits.encoder_step_m = 0.0;
  HilSession exact = session;
  exact.plant.encoder_step_m = 0.0;
  return run_session_on(exact,
                        std::make_shared<VirtualOmega7>(session.plant, session.operator_script()),
                        limits, {}, options);
}

SessionRun accepted(const Json& json) {
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  options.accept_unstable = true;
  return run_without_ceilings(test::parsed(json), options);
}

std::string refused(const Json& json, const DeviceChoice& choice = {}, bool accept = false) {
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  options.accept_unstable = accept;
  try {
    (void)run_session(test::parsed(json), choice, options);
  } catch (const Error& error) {
    CHECK_FALSE(std::filesystem::exists(folder / "r"));
    return error.what();
  }
  return "nothing was refused";
}

TEST_CASE("What would be unstable is refused before a device is opened, with the boundary") {
  CHECK_THAT(refused(stiff_session("1e6 kPa")),
             Contains("stability: unstable: stiffness 1.26e+07 N/m at 1000 Hz"));
  CHECK_THAT(refused(stiff_session("3 MPa")), Contains("unstable"));
  CHECK_THAT(refused(stiff_session("0.5 MPa")),
             StartsWith("stiffness limit of the device: too stiff for the device") &&
                 Contains("at most 5e+03 N/m; expected a softer tissue"));
  CHECK_THAT(refused(stiff_session("1 MPa", 2)), Contains("1000 Hz, 2 ms of delay, friction"));
  CHECK_THAT(refused(stiff_session("12 kPa", 50)), Contains("50 ms of delay"));
  // Hardware is not for trying.
  DeviceChoice omega;
  omega.kind = "omega7";
  omega.library = "/no/such.so";
  CHECK_THAT(refused(stiff_session("1e6 kPa"), omega), Contains("unstable"));
  CHECK_THAT(refused(test::short_session(), omega, true),
             Contains("--accept-unstable: is not for the device 'omega7'"));
}

TEST_CASE("A stable rendering with too little margin is refused, but not called unstable") {
  const auto checked = [](const char* modulus) {
    const HilSession session = test::parsed(stiff_session(modulus));
    const LoopModel loop = make_loop_model(session);
    return check_rendering(session, *loop.model, loop, "virtual");
  };
  const RenderingCheck thin = checked("1 MPa");
  CHECK(thin.spectral_radius < 1.0);
  CHECK(thin.stiffness_N_per_m < thin.stable_N_per_m);
  CHECK(thin.stiffness_N_per_m > RenderingCheck::kRoom * thin.stable_N_per_m);
  CHECK_FALSE(thin.acceptable());
  const std::string refusal = refused(stiff_session("1 MPa"));
  CHECK_THAT(refusal,
             Contains("stability: stable with the operator's arm, but with too little margin: "
                      "stiffness 1.26e+04 N/m") &&
                 Contains("80 % of the 1.35e+04 N/m at which it becomes unstable"));
  CHECK_THAT(refusal, !Contains("unstable: "));
  CHECK(to_json(thin).at("stable") == false);
  CHECK(to_json(thin).at("unstable") == false);

  const RenderingCheck beyond = checked("3 MPa");
  CHECK(beyond.spectral_radius >= 1.0);
  CHECK_THAT(beyond.verdict(), Catch::Matchers::StartsWith("unstable: "));
  CHECK(to_json(beyond).at("unstable") == true);
}

TEST_CASE("What --accept-unstable accepts is instability, and no other refusal") {
  // Too stiff for the device, also where it would be unstable.
  for (const char* modulus : {"0.5 MPa", "3 MPa"}) {
    CAPTURE(modulus);
    const std::string refusal = refused(stiff_session(modulus), {}, true);
    CHECK_THAT(refusal, Contains("too stiff for the device") && Contains("at most 5e+03 N/m"));
    CHECK_THAT(refusal, !Contains("--accept-unstable"));
    CHECK_THAT(refused(stiff_session(modulus)), !Contains("--accept-unstable"));
  }
  // A force that is lost.
  const Json lost = test::with(stiff_session("12 kPa"), "/limits", {{"slew_N_per_s", 1.0}});
  CHECK_THAT(refused(lost, {}, true),
             StartsWith("slew limit: the rise of the force is limited too much") &&
                 Contains("; expected a faster rise (limits/slew_N_per_s) or a softer tissue"));
  CHECK_THAT(refused(lost), !Contains("--accept-unstable"));
  // A depth outside the workspace.
  const Json far =
      test::with(test::short_session(), "/indentations/depths", Json::array({"0.5 m"}));
  CHECK_THAT(refused(far, {}, true), Contains("from the centre of the workspace"));
  // Stability with the arm, and with six hands.
  for (const int delay : {50, 10}) {
    CAPTURE(delay);
    const Json late = stiff_session("12 kPa", delay);
    CHECK_THAT(refused(late), Contains("; --accept-unstable"));
    CHECK(refused(late, {}, true) == "nothing was refused");
  }
  // A rendering whose delay is longer than any that was tried.
  RenderingCheck slow;
  slow.rise_N = slow.stable_N_per_m = slow.largest_N_per_m = slow.hands_N_per_m = 1e9;
  slow.longest_delay_s = 0.021;
  CHECK(slow.refusal(true).empty());
  slow.delay_s = 0.022;
  CHECK_THAT(slow.refusal(true), Contains("the delay is longer than any that is guarded"));
}

/// Mean of the force sent in the second half of the first hold, N, also of what is refused for its
/// rise.
double held_force_N(const Json& json) {
  const test::TempFolder folder;
  const HilSession session = test::parsed(json);
  SessionRunOptions options;
  options.recording = folder / "r";
  (void)run_without_ceilings(session, options);
  const HilRecording recording = read_recording(folder / "r");
  const SessionPhase& hold = session.phases.at(2);
  REQUIRE(hold.kind == SessionPhaseKind::hold);
  const double begin_s = 0.5 * (session.phases.at(1).end_s + hold.end_s);
  double sum_N = 0.0;
  std::size_t count = 0;
  for (const ServoRecord& row : recording.rows) {
    if (recording.time_s(row) < begin_s || recording.time_s(row) > hold.end_s) continue;
    sum_N += recording.commanded_N(row);
    ++count;
  }
  REQUIRE(count > 10);
  return sum_N / static_cast<double>(count);
}

TEST_CASE(
    "A rise limited below a step of the encoder is refused, because the force would be lost") {
  const auto limited = [](const char* modulus, double slew_N_per_s) {
    return test::with(stiff_session(modulus), "/limits", {{"slew_N_per_s", slew_N_per_s}});
  };
  // K q / T with the stiffness at the session's depth: 1.6 N/s at 12 kPa and 0.01 mm.
  CHECK_THAT(refused(limited("12 kPa", 1.0)),
             Contains("the rise of the force is limited too much") &&
                 Contains("a step of the encoder (0.01 mm) makes 0.00159 N"));
  CHECK(held_force_N(limited("12 kPa", 1.0)) < 0.8 * held_force_N(limited("12 kPa", 400.0)));
  CHECK_THAT(held_force_N(limited("12 kPa", 2.0)),
             WithinRel(held_force_N(limited("12 kPa", 400.0)), 0.05));
  CHECK(refused(limited("12 kPa", 2.0)) == "nothing was refused");
}

TEST_CASE("The boundaries of a set-up are those of the theory") {
  const HilSession session = test::parsed(test::short_session());
  const LoopModel loop = make_loop_model(session);
  const RenderingCheck check = check_rendering(session, *loop.model, loop, "virtual");
  // The star at 4 mm: E2 A0/l0 and the tension's slope, 2 E' (1 - cos^3) A0/l0 with tan = e/x.
  const double depth = check.depth_m, slope = 1.0 - std::pow(1.0 + depth * depth / 9e-4, -1.5);
  CHECK(check.depth_m > 3e-3);
  CHECK_THAT(check.stiffness_N_per_m, WithinRel(150.72 * (1.0 + 2.0 * slope), 0.02));
  CHECK_THAT(check.equilibrium_share, WithinRel(0.5, 1e-6));
  CHECK_THAT(check.passive_N_per_m, WithinRel(2.0 * 0.3 / 1e-3, 1e-9));
  CHECK_THAT(check.recovery_s, WithinRel(2.0, 1e-6));  // tau 1 s, E1 = E2
  CHECK(check.passive());
  CHECK(check.stable());
  CHECK(check.spectral_radius < 1.0);
  // A plain spring of friction b and arm B: about 2 (b + B) / T.
  CHECK_THAT(check.stable_N_per_m, WithinRel(2.0 * (0.3 + 6.45) / 1e-3, 0.02));
  // Hardware that was measured: the largest delay seen and a period more.
  DeviceLimits measured = limits_of("omega7");
  measured.measured_delay_s = 0.3e-3;
  measured.measured_friction_N_s_per_m = 0.1;
  const RenderingCheck omega = check_rendering(session, *loop.model, loop, measured);
  CHECK_THAT(omega.delay_s, WithinRel(1.3e-3, 1e-9));
  CHECK(omega.delay_periods == 2);
  CHECK_THAT(omega.passive_N_per_m, WithinRel(0.1 / 1.8e-3, 1e-9));
  CHECK_FALSE(omega.passive());
  CHECK(omega.acceptable());
}

TEST_CASE("What is unstable and accepted ends with a cause of its own, not as finished") {
  for (const char* modulus : {"1e6 kPa", "3 MPa"}) {
    CAPTURE(modulus);
    const StopCause cause = accepted(stiff_session(modulus)).outcome.cause;
    CAPTURE(to_string(cause));
    CHECK((cause == StopCause::oscillation || cause == StopCause::energy));
  }
  Json delayed = stiff_session("36 kPa", 50);
  const StopCause cause = accepted(delayed).outcome.cause;
  CHECK((cause == StopCause::oscillation || cause == StopCause::energy));
}

TEST_CASE("A rest in which the tissue cannot recover is warned of") {
  const auto remarks = [](const char* rest) {
    Json json = test::short_session();
    json["indentations"]["rest"] = rest;
    const HilSession session = test::parsed(json);
    const LoopModel loop = make_loop_model(session);
    return check_rendering(session, *loop.model, loop, "virtual").remarks;
  };
  REQUIRE(remarks("1 s").size() == 1);  // the surface recovers in 2 s
  CHECK(remarks("1 s").front().code == "rest_too_short");
  CHECK(remarks("9.3 s").empty());
}

// --- the start ------------------------------------------------------------------------------

TEST_CASE("A hand that rests in the tissue feels nothing, and the session is given up") {
  Json json = test::short_session();
  json["virtual_device"]["arm_set_point"] = "12 mm";
  json["start"]["limit"] = "2 s";
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  double most_N = 0.0;
  std::string said;
  options.watcher = [&](const ServoRecord& row) {
    most_N = std::max(most_N, std::abs(row.commanded_N[2]));
    said = instruction_of(row);
  };
  const SessionRun run = run_session(test::parsed(json), {}, options);
  CHECK(run.outcome.cause == StopCause::not_in_place);
  CHECK(most_N == 0.0);
  CHECK(said == "Draw the tool back, out of the tissue: it is 12 mm below the surface");
  const HilRecording recording = read_recording(folder / "r");
  CHECK(recording.closing.at("cause") == "operator not in place");
  REQUIRE(recording.rows.size() == 1);
  CHECK(recording.rows.back().phase == -1);
  CHECK_THAT(recording.rows.back().tool_depth_m, WithinAbs(12e-3, 1e-5));
}

TEST_CASE("Phases wait until the tool is in the air, inside the workspace and at rest") {
  Puppet device;
  ElementContact model = element_of(12e3, 1.0);
  ServoSettings settings = guarded(1000);
  settings.gate = StartGateSettings{};
  ServoStep step(device, model, settings);
  ServoRecord row;
  const auto run = [&](int cycles) {
    for (int i = 0; i < cycles; ++i) REQUIRE(step.cycle(0, row) == StopCause::none);
  };
  device.at.z() = 5e-3;  // in the tissue
  run(1000);
  CHECK((row.flags & kInTissue) != 0);
  device.at.z() = -0.2;  // out of reach
  run(1000);
  CHECK((row.flags & kOutOfReach) != 0);
  for (int i = 0; i < 2000; ++i) {  // moving at 20 mm/s
    device.at.z() = -0.01 - 1e-5 * (i % 1000);
    run(1);
    REQUIRE((row.flags & kMoving) != 0);
  }
  CHECK(step.cycles() == 0);
  CHECK(device.most_N == 0.0);
  device.at.z() = -3e-3;
  run(249);
  CHECK(row.phase == -1);
  run(2);
  CHECK(row.phase == 0);
  CHECK(row.cycle == 0);
  CHECK(device.begun == 1);
}

TEST_CASE("The surface is put before the hand, wherever that is") {
  Json json = test::short_session();
  json["surface_before_hand"] = "4 mm";
  json.erase("creep");
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  const SessionRun run = run_session(test::parsed(json), {}, options);
  CHECK(run.outcome.cause == StopCause::finished);
  const HilRecording recording = read_recording(folder / "r");
  CHECK_THAT(recording.rows.front().tool_depth_m, WithinAbs(-4e-3, 1e-12));
  CHECK_THAT(recording.session.servo.surface_m.z(), WithinAbs(0.0, 1e-5));
  double deepest = 0.0;
  for (const ServoRecord& row : recording.rows) deepest = std::max(deepest, row.tool_depth_m);
  CHECK_THAT(deepest, WithinAbs(4e-3, 0.2e-3));
  json["surface"] = Json::array({"0 mm", "0 mm", "0 mm"});
  CHECK_THROWS_WITH(test::parsed(json), Contains("the surface is already given"));
}

// --- limits ---------------------------------------------------------------------------------

TEST_CASE("Limits have ceilings, and a session has to fit into the workspace") {
  struct Case {
    const char* pointer;
    Json value;
    const char* message;
  };
  const Case bad = GENERATE(
      Case{"/limits/damping_N_s_per_m", 1e4,
           "key /limits/damping_N_s_per_m: 10000; expected 0 to 30"},
      Case{"/limits/slew_N_per_s", 1e9, "key /limits/slew_N_per_s: 1000000000; expected 1 to 2000"},
      Case{"/limits/ramp_in", "0 s", "key /limits/ramp_in: 0 s; expected 0.1 to 60 s"},
      Case{"/limits/outside_validity", "1 min", "key /limits/outside_validity: 60 s"},
      Case{"/indentations/depths", Json::array({"10 m"}),
           "the tool would go 10 m from the centre of the workspace; expected 0.075 m at most"},
      Case{"/surface", Json::array({"0.5 m", "0 m", "0 m"}),
           "key /surface: out of the device's reach"},
      Case{"/surface", Json::array({"0 m", "0 m", "-72 mm"}), "the tool would go 0.084 m"},
      Case{"/surface_before_hand", "60 mm", "key /surface_before_hand: 0.06 m"},
      Case{"/start/limit", "0 s", "key /start/limit"});
  CAPTURE(bad.pointer, bad.value.dump());
  CHECK_THROWS_WITH(test::parsed(test::with(test::short_session(), bad.pointer, bad.value)),
                    Contains(bad.message));
}

TEST_CASE("A session has to fit before the stop of the Omega.7 along x") {
  const auto pushed = [](Json push, const char* x_mm) {
    Json json = test::with(test::short_session(), "/surface", Json::array({x_mm, "0 mm", "0 mm"}));
    json["push"] = std::move(push);
    return json;
  };
  const Json along = Json::array({1, 0, 0}), across = Json::array({0, 0, -1});
  const DeviceLimits omega = limits_of("omega7"), simulated = limits_of("virtual");
  // 12 mm under loads, as deep as the tissue bears.
  for (const DeviceLimits& limits : {omega, simulated}) {
    CHECK_NOTHROW(require_within(test::parsed(pushed(along, "42 mm")), limits));
    CHECK_THROWS_WITH(require_within(test::parsed(pushed(along, "44 mm")), limits),
                      Contains("the session's furthest place is 0.056 m from the centre along x; "
                               "expected at most 0.055 m, where the mechanism has its stop"));
    CHECK_NOTHROW(require_within(test::parsed(pushed(across, "54 mm")), limits));
    CHECK_THROWS_WITH(require_within(test::parsed(pushed(across, "-56 mm")), limits),
                      Contains("0.056 m from the centre along x"));
  }
  // Of a device whose stop is not known the radius counts alone, which is 75 mm here too.
  CHECK_NOTHROW(require_within(test::parsed(pushed(along, "44 mm")), limits_of("sigma7")));
  CHECK_THAT(refused(pushed(along, "44 mm")), StartsWith("device 'virtual': the session's"));
  // Wherever the hand is then, the way to the surface and 12 mm into it stay free along x.
  Json before = test::with(test::short_session(), "/surface_before_hand", "20 mm");
  CHECK_THAT(test::parsed(before).servo.gate->reach_m, WithinAbs(0.075 - 0.040, 1e-12));
  before["push"] = along;
  CHECK_THAT(test::parsed(before).servo.gate->reach_m, WithinAbs(0.055 - 0.032, 1e-12));
}

TEST_CASE("The room before a session is that of its device, not that of the Omega.7") {
  const Json weak = test::with(test::short_session(), "/limits/force", "3 N");
  const auto before = [&](const char* way) {
    return test::parsed(test::with(weak, "/surface_before_hand", way));
  };
  const DeviceLimits falcon = limits_of("falcon"), inverse3 = limits_of("inverse3");
  REQUIRE(falcon.reach_m < inverse3.reach_m);
  // 10 mm to the surface and 12 mm into it.
  for (const DeviceLimits& limits : {falcon, inverse3}) {
    CHECK_NOTHROW(require_within(before("10 mm"), limits));
    CHECK_THAT(on_device(before("10 mm"), limits).servo.gate->reach_m,
               WithinAbs(limits.reach_m - 0.022, 1e-12));
  }
  // As far back again.
  CHECK_THROWS_WITH(require_within(before("22 mm"), falcon),
                    Contains("the session's furthest place is 0.044 m from the hand at the start; "
                             "expected at most 0.04 m from the centre"));
  // Commands read a session for their device; a program may run it on another one, before which
  // no such device is opened.
  DeviceChoice other;
  other.kind = "falcon";
  CHECK_THROWS_WITH(run_session(before("22 mm"), other, {}),
                    StartsWith("device 'falcon': the session's furthest place is 0.044 m from the "
                               "hand at the start"));
  CHECK_THROWS_WITH(run_session_on(before("22 mm"), nullptr, falcon, {}, {}),
                    StartsWith("device 'falcon': the session's furthest place is 0.044 m from the "
                               "hand at the start"));
  // Within the radius of both, but not before the stop of one: 37 mm to the surface, 20 mm deep.
  Json along_x = test::with(weak, "/surface_before_hand", "37 mm");
  along_x = test::with(along_x, "/indentations/depths", Json::array({"20 mm"}));
  along_x["push"] = Json::array({1, 0, 0});
  CHECK_THROWS_WITH(
      require_within(parse_session(along_x, "session", {}, limits_of("sigma7")),
                     limits_of("omega7")),
      Contains("the session's furthest place is 0.057 m from the hand at the start along x; "
               "expected at most 0.055 m, where the mechanism has its stop"));
  const Json far = test::with(weak, "/surface", Json::array({"0 m", "0 m", "-66 mm"}));
  CHECK_THROWS_WITH(parse_session(far, "session", {}),
                    Contains("0.078 m from the centre of the workspace; expected 0.075 m"));
  CHECK_NOTHROW(require_within(parse_session(far, "session", {}, inverse3), inverse3));
}

TEST_CASE("The device is asked for no more than the session's limit") {
  Json json = test::with(test::short_session(), "/limits/force", "3 N");
  CHECK(test::parsed(json).preparation.max_force_N == 3.0);
  CHECK(test::parsed(test::short_session()).preparation.max_force_N == 8.0);
}

}  // namespace
}  // namespace tpm::haptics
