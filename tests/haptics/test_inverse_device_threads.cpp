// --device inverse3 on a stand-in service: sessions, delays, and each way in which a service fails.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <functional>
#include <thread>

#include "inverse_sessions.hpp"
#include "temp_folder.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/session/identify_run.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using namespace std::chrono_literals;
using namespace test::inverse_sessions;
using test::StandInFaults;
using test::StandInInverse;
using How = StandInFaults::How;

TEST_CASE("A service is opened in both formats, made neutral, and what it says is recorded") {
  for (const bool old : {false, true}) {
    StandInFaults faults;
    faults.version = old ? "3.1.1.0" : "3.5.0.0";
    StandInInverse service(PlantSettings{}, {}, false, faults);
    InverseDevice device(service.address(), limits_of("inverse3"));
    const DeviceIdentity& identity = device.open();
    CHECK(identity.kind == "inverse3");
    CHECK(identity.serial == "049D");
    CHECK(identity.left_handed);
    CHECK_FALSE(identity.hardware);  // it says SIMULATED DEVICE
    CHECK_THAT(identity.library_version, Contains(old ? "values" : "vector"));
    std::string all;
    for (const Remark& line : identity.assumptions) all += line.text + "\n";
    CHECK_THAT(all, Contains("force gate 0") && Contains("preset 'arm_front_centered'") &&
                        Contains("at most 4 N (assumed: ") &&
                        Contains("80 mm from the middle of the workspace (assumed: "));
    CHECK(service.last_profile() == "org.tpmkit:tpm-hil");
    device.prepare({});
    device.enable_forces();
    CHECK(device.write({0.0, 0.0, 1.25}) == DeviceAnswer::ok);
    CHECK(service.last_N().z() == 1.25);
    CHECK((service.last_format() == InverseFormat::values) == old);
    CHECK(device.write({0.0, 0.0, 50.0}) == DeviceAnswer::saturated);
    CHECK_THAT(service.last_N().z(), WithinAbs(4.0, 1e-12));
    Eigen::Vector3d at_m(1.0, 1.0, 1.0);
    CHECK(device.read(at_m) == DeviceAnswer::ok);
    CHECK(at_m.norm() < 0.01);  // from the middle of the workspace
    service.press(0b10U);
    (void)device.write({0.0, 0.0, 0.5});
    (void)device.read(at_m);
    const HandState hand = device.hand();
    CHECK(hand.buttons == 0b10U);
    CHECK((hand.grip[0] == 0.5F && hand.grip[1] == -0.5F && hand.grip[3] == -0.5F));
    device.stop();
    for (int i = 0; i < 4000 && service.last_N().norm() > 0.0; ++i) {
      std::this_thread::sleep_for(5ms);
    }
    CHECK(service.last_N().norm() == 0.0);
  }
}

TEST_CASE("A service that is not what it should be is refused with the reason", "[untimed]") {
  StandInFaults f;
  f.keeps = {"force_gate"};
  CHECK_THAT(refusal(f), Contains("force gate of the service stays at 0.3"));
  f = {};
  f.names_no_filters = true;
  for (const char* version : {"3.5.0.0", "3.1.0.0"}) {
    f = {};
    f.version = version;
    f.names_no_filters = true;
    CHECK_THAT(refusal(f), Contains(fmt::format("the service of version {} does not say what its "
                                                "force gate does to a force; expected a service "
                                                "that lists both filters: install version 3.5",
                                                version)));
    f.names_no_filters = false;
    f.names_no_damping = true;
    CHECK_THAT(refusal(f), Contains("does not say what its damping does to a force"));
  }
  f = {};
  f.damping = 0.5;
  f.keeps = {"damping"};
  CHECK_THAT(refusal(f), Contains("damping of the service stays at 0.5"));
  f.damping = 0.0;
  f.damping_along_z = 0.2;
  CHECK_THAT(refusal(f), Contains("damping of the service stays at 0, by direction 0 0 0.2"));
  f = {};
  f.scale = 2.0;
  CHECK_THAT(refusal(f), Contains("scales coordinates"));
  for (const char* version : {"3.5.0.0", "3.1.0.0"}) {
    f = {};
    f.version = version;
    f.keeps = {"preset", "basis", "mount", "gravity_compensation"};
    f.gravity = 1.0;
    CHECK_THAT(refusal(f), Contains("preset of the service stays at 'defaults'"));
    f.preset = kCentredPreset;
    f.basis = "YXZ";
    CHECK_THAT(refusal(f), Contains("exchanges axes: basis YXZ; expected basis XYZ"));
    f.basis = "XYZ";
    f.mount_turned_rad = 0.5;
    CHECK_THAT(refusal(f), Contains("turns coordinates: a mount by 0.5"));
  }
  f = {};
  f.version = "4.0.0.0";
  CHECK_THAT(refusal(f), Contains("of version '4.0.0.0'; expected 3.1 or later"));
  f = {};
  f.no_inventory = true;
  CHECK_THAT(refusal(f), Contains("the service is silent"));
  f = {};
  f.devices = {};
  CHECK_THAT(refusal(f), Contains("the service has no device; expected one that is plugged in"));
  f = {};
  f.wrong_accept = "AAAA";
  CHECK_THAT(refusal(f), Contains("Sec-WebSocket-Accept is not that of the key"));
  f = {};
  f.no_events = true;
  CHECK_THAT(refusal(f), Contains("no WebSocket"));
  InverseDevice nobody({1, 1, 1, ""}, limits_of("inverse3"));
  CHECK_THAT(refusal_of([&] { (void)nobody.open(); }),
             Contains("port 1 of this machine: nobody answers"));
}

/// In real time, at 1 kHz.
DevicePreparation in_real_time(double watchdog_s) {
  DevicePreparation preparation;
  preparation.real_time = true;
  preparation.watchdog_s = watchdog_s;
  return preparation;
}

TEST_CASE("The first position is one of now, not one that was waiting", "[untimed]") {
  StandInFaults f;
  f.unasked_states = 3;
  StandInInverse service(PlantSettings{}, {}, false, f);
  InverseDevice device(service.address(), limits_of("inverse3"));
  (void)device.open();
  device.prepare({});
  device.enable_forces();
  Eigen::Vector3d at_m;
  for (int i = 0; i < 5; ++i) {
    CHECK(device.read(at_m) == DeviceAnswer::ok);
    CHECK(at_m.norm() < 0.01);  // and not test::stand_in::kElsewhere_m
    CHECK(device.write(Eigen::Vector3d::Zero()) == DeviceAnswer::ok);
  }
  // A service that falls silent after it was opened has no position to begin with.
  f = {};
  f.answers = 1;
  for (const bool real_time : {false, true}) {
    StandInInverse silent(PlantSettings{}, {}, true, f);
    InverseDevice opened(silent.address(), limits_of("inverse3"));
    (void)opened.open();
    std::this_thread::sleep_for(50ms);
    DevicePreparation preparation = in_real_time(0.016);
    preparation.real_time = real_time;
    CHECK_THAT(refusal_of([&] { opened.prepare(preparation); }), Contains("sends no state"));
  }
}

TEST_CASE("A state is as old as the message that it answers") {
  UnansweredMessages messages;
  CHECK_FALSE(messages.answered());
  for (std::int64_t at = 1; at <= 2000; ++at) messages.sent(at);
  CHECK(messages.answered() == 977);  // of the last 1024
  messages.forget_before(1999);
  CHECK(messages.answered() == 1999);
  CHECK(messages.answered() == 2000);
  CHECK_FALSE(messages.answered());

  // Answers that take 3 to 6 periods are late, each of them, and positions all the same.
  for (const double jitter_s : {0.0, 0.003}) {
    StandInFaults f;
    f.late_s = 0.006 - jitter_s;
    f.jitter_s = jitter_s;
    StandInInverse service(PlantSettings{}, {}, true, f);
    InverseDevice device(service.address(), limits_of("inverse3"));
    (void)device.open();
    device.prepare(in_real_time(2.0));
    device.enable_forces();
    int fresh = 0;
    Eigen::Vector3d at_m;
    for (int i = 0; i < 200; ++i) {
      const DeviceAnswer answer = device.read(at_m);
      REQUIRE(answer != DeviceAnswer::failed);
      fresh += answer == DeviceAnswer::ok;
      CHECK(device.write({0.0, 0.0, 0.1}) == DeviceAnswer::ok);
      std::this_thread::sleep_for(1ms);
    }
    device.stop();
    CHECK(fresh == 0);
    CHECK(device.status().time_guards == 200);
    CHECK(device.status().forces_off == ForcesOff::none);
    CHECK(device.traffic().messages > 20);
  }
}

TEST_CASE("A device that keeps the clock has no virtual time") {
  StandInFaults faults;
  faults.simulated = false;
  StandInInverse service(PlantSettings{}, {}, false, faults);
  InverseDevice device(service.address(), limits_of("inverse3"));
  CHECK(device.open().hardware);
  CHECK_THAT(refusal_of([&] { device.prepare({}); }), Contains("expected --clock real"));
}

TEST_CASE("Delays of 0, 2 and 5 ms are found, and the session is verified as any other",
          "[heavy][untimed]") {
  const test::TempFolder folder;
  for (const int late_ms : {0, 2, 5}) {
    const HilSession session = test::parsed(inverse_session());
    DeviceChoice choice;
    {
      PlantSettings free = plant_of(session, late_ms);
      free.arm = {1e-9, 0.0, 0.0, 0.0};  // nobody holds it
      StandInInverse service(free, {}, false);
      choice = choice_of(service);
      DeviceIdentifyOptions options;
      options.duration_s = 8.0;
      const IdentifyRun identified = run_identification(choice, session, options);
      CAPTURE(late_ms, to_string(identified.outcome.cause), identified.outcome.device.error_text);
      REQUIRE(identified.found.delay_mean_s);
      CHECK_THAT(*identified.found.delay_mean_s, WithinAbs(1e-3 * late_ms, 0.5e-3 + 1e-9));
      CHECK_THAT(*identified.found.delay_largest_s, WithinAbs(1e-3 * late_ms, 1e-3 + 1e-9));
      choice.file = folder / fmt::format("late{}.json", late_ms);
      std::ofstream(choice.file) << to_text(device_file_json(identified, "2026-11-28"));
    }
    StandInInverse service(plant_of(session, late_ms), session.operator_script(), false);
    const std::filesystem::path file = choice.file;
    choice = choice_of(service);
    choice.file = file;
    SessionRunOptions options;
    options.recording = folder / fmt::format("late{}.tpmrec", late_ms);
    bool begun = false;
    options.watcher = [&](const ServoRecord& row) {
      if (row.phase >= 0 && !begun) {
        service.begin();
        service.press(0b101U);
      }
      begun = begun || row.phase >= 0;
    };
    const SessionRun run = run_session(session, choice, options);
    CAPTURE(late_ms, run.outcome.detail, run.outcome.device.error_text);
    REQUIRE(run.outcome.cause == StopCause::finished);
    CHECK(run.rendering.delay_measured);
    CHECK(service.largest_N() <= 3.0);
    const HilRecording recording = read_recording(options.recording);
    CHECK(recording.simulated());
    CHECK_THAT(device_line(recording), Contains("SIMULATED DEVICE"));
    CHECK(recording.header.at("device").at("serial") == "049D");
    CHECK((recording.rows.back().grip[0] == 0.5F && recording.rows.back().grip[1] == -0.5F));
    CHECK(recording.rows.back().buttons == 0b101U);
    CHECK(recording.closing.at("markers").size() == 1);
    const Verification v = verify(recording, {.window_s = 0.0});
    CHECK(v.all.max_N < 0.01 * v.all.peak_N);
    CHECK(v.all.peak_N > 0.1);
    UNSCOPED_INFO(
        fmt::format("{} ms put in: max/peak {:.3g} %", late_ms, 1e2 * v.all.max_N / v.all.peak_N));
  }
}

TEST_CASE("A measurement goes on after a lost connection, and says so", "[untimed]") {
  const HilSession session = test::parsed(inverse_session());
  constexpr int kLate_ms = 2;
  PlantSettings free = plant_of(session, kLate_ms);
  free.arm = {1e-9, 0.0, 0.0, 0.0};
  StandInFaults faults;
  faults.how = How::close;
  faults.from = 3000;
  StandInInverse service(free, {}, false, faults);
  DeviceIdentifyOptions options;
  options.duration_s = 8.0;
  const IdentifyRun run = run_identification(choice_of(service), session, options);
  CAPTURE(to_string(run.outcome.cause), run.outcome.device.error_text);
  CHECK(run.outcome.cause == StopCause::finished);
  CHECK(run.begun_again == 1);
  CHECK(run.found.stalls == 1);  // nothing is known of the time between the connections
  REQUIRE(run.found.delay_mean_s);
  CHECK_THAT(*run.found.delay_mean_s, WithinAbs(1e-3 * kLate_ms, 0.5e-3 + 1e-9));
  const Json file = device_file_json(run, "2026-11-28");
  CHECK(file.at("measurement").at("begun_again") == 1);
  CHECK(file.at("measurement").at("stalled_s").get<double>() > 0.4);
  // Of one that never answers again, what was measured until then is used, and the rest is named.
  faults.how = How::silence;
  faults.from = 6500;
  StandInInverse silent(free, {}, false, faults);
  const IdentifyRun part = run_identification(choice_of(silent), session, options);
  CHECK(part.measured_s > 0.0);
  CHECK(part.measured_s < options.duration_s);
  REQUIRE(part.found.delay_mean_s);
  CHECK_THAT(*part.found.delay_mean_s, WithinAbs(1e-3 * kLate_ms, 0.5e-3 + 1e-9));
  REQUIRE_FALSE(part.found.not_identified.empty());
  CHECK_THAT(part.found.not_identified.back().text, Contains("everything after ") &&
                                                        Contains("does not open again: ") &&
                                                        Contains("the service is silent"));
}

/// A session, message by message, on a service that goes wrong.
SessionRun run_on(const StandInFaults& faults,
                  const std::function<void(StandInInverse&)>& act = {}) {
  const test::TempFolder folder;
  Json brief = inverse_session();  // under ThreadSanitizer a cycle takes 4 ms
  brief["indentations"].update({{"hold", "0.5 s"}, {"rest", "0.2 s"}});
  brief["creep"].update({{"hold", "0.3 s"}, {"rest", "0.2 s"}});
  const HilSession session = test::parsed(brief);
  StandInInverse service(plant_of(session, 0), session.operator_script(), false, faults);
  const auto device =
      std::make_shared<InverseDevice>(service.address("049D"), limits_of("inverse3"));
  DeviceLimits limits = limits_of("inverse3");
  limits.simulated = true;  // its delay is not what is tried here
  SessionRunOptions options;
  options.recording = folder / "failed.tpmrec";
  bool begun = false;
  options.watcher = [&](const ServoRecord& row) {
    if (row.phase < 0 || begun) return;
    begun = true;
    service.begin();
    if (act) act(service);
  };
  SessionRun run = run_session_on(session, device, limits, {}, options);
  if (faults.how != How::close) {
    for (int i = 0; i < 4000 && service.last_N().norm() > 0.0; ++i) {
      std::this_thread::sleep_for(5ms);
    }
    CHECK(service.last_N().norm() == 0.0);
  }
  const HilRecording recording = read_recording(options.recording);
  CHECK(recording.closing.at("device_error_text") == std::string(run.outcome.device.error_text));
  return run;
}

TEST_CASE("Each way in which a service fails ends the session with its cause", "[untimed]") {
  struct Case {
    How how;
    StopCause cause;
    const char* words;
  };
  for (const Case& c : {Case{How::silence, StopCause::communication, "the service is silent"},
                        Case{How::close, StopCause::communication, "the service is gone"},
                        Case{How::garbage, StopCause::forces_off, "sends what is no state"},
                        Case{How::other_device, StopCause::forces_off, "sends what is no state"}}) {
    StandInFaults faults;
    faults.from = 800;
    faults.how = c.how;
    const SessionRun run = run_on(faults);
    CAPTURE(static_cast<int>(c.how), to_string(run.outcome.cause), run.outcome.device.error_text);
    CHECK(run.outcome.cause == c.cause);
    CHECK_THAT(run.outcome.device.error_text, Contains(c.words));
  }
}

TEST_CASE("A workspace that is scaled, turned or moved during a session ends it", "[untimed]") {
  for (const char* transform : {R"({"scale":{"x":10,"y":10,"z":10}})",
                                R"({"rotation":{"w":0.7071,"x":0.7071,"y":0,"z":0}})",
                                R"({"position":{"x":0.05,"y":0,"z":0}})"}) {
    CAPTURE(transform);
    StandInFaults faults;
    faults.how = How::workspace;
    faults.transform = transform;
    faults.from = 800;
    const SessionRun run = run_on(faults);
    CHECK(run.outcome.cause == StopCause::software);
    CHECK_THAT(run.outcome.device.error_text, Contains("has moved, turned or scaled"));
  }
  // From the first state on: refused, but for a workspace that only lies elsewhere.
  for (const char* transform : {R"({"scale":{"x":10,"y":10,"z":10}})",
                                R"({"rotation":{"w":0.7071,"x":0.7071,"y":0,"z":0}})"}) {
    CAPTURE(transform);
    StandInFaults faults;
    faults.how = How::workspace;
    faults.transform = transform;
    StandInInverse service(PlantSettings{}, {}, true, faults);
    InverseDevice device(service.address(), limits_of("inverse3"));
    CHECK_THROWS_WITH(device.open(), Contains("the service scales coordinates") ||
                                         Contains("the service turns coordinates"));
  }
  StandInFaults elsewhere;
  elsewhere.how = How::workspace;
  elsewhere.transform = R"({"position":{"x":0.05,"y":0,"z":0}})";
  CHECK(run_on(elsewhere).outcome.cause == StopCause::finished);
}

TEST_CASE("Events of the service end a session with their words", "[untimed]") {
  struct Case {
    InverseEvent event;
    StopCause cause;
  };
  for (const Case& c :
       {Case{{"device-disconnected", "warning", "049D", "", "lost"}, StopCause::unplugged},
        Case{{"device-busy", "warning", "049d", "", "taken\nby another"}, StopCause::software},
        Case{{"device-safety-triggered", "error", "049D", "ebrake_triggered", "brake"},
             StopCause::software},
        // Of another device, or none that takes forces away.
        Case{{"device-disconnected", "warning", "FFFF", "", "lost"}, StopCause::finished},
        Case{{"device-safety-triggered", "notice", "049D", "ebrake_released", "brake"},
             StopCause::finished}}) {
    const SessionRun run = run_on({}, [&c](StandInInverse& service) { service.tell(c.event); });
    CAPTURE(c.event.name, to_string(run.outcome.cause), run.outcome.device.error_text);
    CHECK(run.outcome.cause == c.cause);
    if (c.cause != StopCause::finished) {
      CHECK_THAT(run.outcome.device.error_text,
                 Contains(c.event.name) && Contains(c.event.safety_type));
    }
  }
}

TEST_CASE(
    "A thread of messages without commands sends zero, and states that stop are no position") {
  StandInInverse service(PlantSettings{}, {}, true);
  InverseDevice device(service.address(), limits_of("inverse3"));
  (void)device.open();
  DevicePreparation preparation;
  preparation.real_time = true;
  preparation.watchdog_s = 4.0;  // the machine may stall
  device.prepare(preparation);
  device.enable_forces();
  const auto until = [&](const std::function<bool()>& met) {
    for (int i = 0; i < 20'000 && !met(); ++i) std::this_thread::sleep_for(1ms);
    return met();
  };
  CHECK(until([&] {
    (void)device.write({0.0, 0.0, 1.0});
    return service.last_N().z() == 1.0;
  }));
  CHECK(until([&] { return service.last_N().norm() == 0.0; }));  // the watchdog's time is over
  CHECK(device.status().forces_off == ForcesOff::watchdog);
  CHECK(device.write({0.0, 0.0, 1.0}) == DeviceAnswer::failed);
  std::this_thread::sleep_for(20ms);
  CHECK(service.last_N().norm() == 0.0);
  device.stop();
}

TEST_CASE("Forces that are cut from another thread are zero at the service before that returns") {
  StandInInverse service(PlantSettings{}, {}, true);
  InverseDevice device(service.address(), limits_of("inverse3"));
  (void)device.open();
  DevicePreparation preparation;
  preparation.real_time = true;
  preparation.watchdog_s = 10.0;
  device.prepare(preparation);
  device.enable_forces();
  for (int i = 0; i < 20'000 && service.last_N().z() != 2.0; ++i) {
    (void)device.write({0.0, 0.0, 2.0});
    std::this_thread::sleep_for(1ms);
  }
  REQUIRE(service.last_N().z() == 2.0);
  std::thread([&] { device.cut_forces(); }).join();
  for (int i = 0; i < 20'000 && service.last_N().norm() > 0.0; ++i) {
    std::this_thread::sleep_for(1ms);
  }
  CHECK(service.last_N().norm() == 0.0);
  CHECK(device.write({0.0, 0.0, 2.0}) == DeviceAnswer::failed);
  device.stop();
}

TEST_CASE("Answers that are dropped now and then end nothing") {
  StandInFaults faults;
  faults.from = 1;
  faults.how = How::drop_every_third;
  StandInInverse service(PlantSettings{}, {}, true, faults);
  InverseDevice device(service.address(), limits_of("inverse3"));
  (void)device.open();
  DevicePreparation preparation;
  preparation.real_time = true;
  preparation.watchdog_s = 10.0;
  device.prepare(preparation);
  device.enable_forces();
  Eigen::Vector3d at_m;
  for (int i = 0; i < 300; ++i) {
    CHECK(device.read(at_m) != DeviceAnswer::failed);
    CHECK(device.write({0.0, 0.0, 0.1}) == DeviceAnswer::ok);
    std::this_thread::sleep_for(1ms);
  }
  device.stop();
  CHECK(device.traffic().unanswered > 5);
  CHECK(device.status().forces_off == ForcesOff::none);
}

}  // namespace
}  // namespace tpm::haptics
