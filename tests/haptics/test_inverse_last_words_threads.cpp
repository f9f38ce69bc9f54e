// Why a device ended a session: events of an Inverse service just before it closes, positions that
// were too old, and settings without which no session begins.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "inverse_sessions.hpp"
#include "made_check.hpp"
#include "shaken_contact.hpp"
#include "tpm/base/remark.hpp"
#include "tpm/haptics/loop/empty_space.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/haptics/session/jitter_check.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using namespace test::inverse_sessions;
using test::StandInFaults;
using test::StandInInverse;
using How = StandInFaults::How;

/// Status after the end of a device whose service fails at its fifth force.
DeviceStatus status_after_end(const StandInFaults& faults, bool real_time) {
  StandInInverse service(PlantSettings{}, {}, real_time, faults);
  InverseDevice device(service.address(), limits_of("inverse3"));
  (void)device.open();
  DevicePreparation preparation;
  preparation.watchdog_s = 2.0;
  preparation.real_time = real_time;
  device.prepare(preparation);
  device.enable_forces();
  constexpr int kMost = 20'000;
  for (int i = 0; i < kMost && device.write({0.0, 0.0, 0.1}) != DeviceAnswer::failed; ++i) {
    if (real_time) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  device.stop();
  CHECK(device.learn_end());
  return device.status();
}

TEST_CASE("An event that a service sends before it closes is the cause of the end") {
  for (const int variant : {0, 1, 2, 3}) {
    const bool real_time = variant % 2 == 1;
    StandInFaults f;
    f.from = 5;
    f.how = How::close;
    f.close_code = 1001;
    f.closes_behind_a_state = variant >= 2;  // both are read at once
    CAPTURE(real_time, f.closes_behind_a_state);
    DeviceStatus status = status_after_end(f, real_time);
    CHECK(status.forces_off == ForcesOff::none);
    CHECK_THAT(status.error_text, Contains("closed with 1001"));
    f.last_event = "device-disconnected";
    status = status_after_end(f, real_time);
    CHECK(status.forces_off == ForcesOff::unplugged);
    CHECK_FALSE(status.failed);
    CHECK_THAT(status.error_text, Contains("device-disconnected"));
    f.last_event = "device-busy";
    CHECK(status_after_end(f, real_time).forces_off == ForcesOff::software);
  }
}

TEST_CASE("Findings and a cut of the forces come from other threads while loop and messages run") {
  for (const bool is_cut : {false, true}) {
    CAPTURE(is_cut);
    StandInFaults f;
    f.in_use = true;
    f.simulated = false;
    if (!is_cut) {
      f.from = 50;
      f.how = StandInFaults::How::close;
      f.close_code = 1001;
      f.last_event = "device-disconnected";
    }
    StandInInverse service(PlantSettings{}, {}, true, f);
    InverseDevice device(service.address(), limits_of("inverse3"));
    (void)device.open();
    std::atomic<bool> ended{false}, complete{true};
    std::thread looking([&] {
      while (!ended) {
        const std::vector<DeviceFinding> found = device.findings();
        if (found.empty() || found.front().code != "in_use") complete = false;
      }
    });
    DevicePreparation preparation;
    preparation.watchdog_s = 2.0;
    preparation.real_time = true;
    device.prepare(preparation);
    std::thread loop([&] {
      device.enable_forces();
      Eigen::Vector3d at_m;
      constexpr int kMostPeriods = 20'000;
      for (int i = 0; i < kMostPeriods; ++i) {
        if (device.read(at_m) == DeviceAnswer::failed) break;
        if (device.write({0.0, 0.0, 0.1}) == DeviceAnswer::failed) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      device.stop();
    });
    if (is_cut) {
      while (service.forces() < 50) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      device.cut_forces();
    }
    loop.join();
    ended = true;
    looking.join();
    CHECK(complete);
    CHECK(device.learn_end());
    const DeviceStatus status = device.status();
    CHECK(status.forces_off == (is_cut ? ForcesOff::software : ForcesOff::unplugged));
    CHECK_FALSE(status.failed);
  }
}

TEST_CASE("States that list the device no more end a session with these words", "[untimed]") {
  StandInFaults f;
  f.version = "3.1.0.0";
  f.from = 5;
  f.how = StandInFaults::How::no_device;
  const DeviceStatus status = status_after_end(f, false);
  CHECK(status.forces_off == ForcesOff::unknown);
  CHECK_THAT(status.error_text, Contains("device is listed no more"));
  f.how = StandInFaults::How::garbage;
  CHECK_THAT(status_after_end(f, false).error_text, !Contains("listed"));
}

TEST_CASE("A service that falls silent while it is opened is quoted with its event", "[untimed]") {
  StandInFaults f;
  f.answers = 0;
  StandInInverse service(PlantSettings{}, {}, false, f);
  InverseDevice device(service.address(), limits_of("inverse3"));
  std::atomic<bool> opened{false};
  std::thread talking([&] {
    while (!opened) {
      service.tell({"device-busy", "error", "049D", "", "taken"});
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  const std::string said = refusal_of([&] { (void)device.open(); });
  opened = true;
  talking.join();
  CHECK_THAT(said, Contains("the service says device-busy"));
}

/// Fails, or has nothing but old positions; only at the end does it know that it is unplugged.
class LastWordsHandle final : public test::Puppet {
 public:
  LastWordsHandle(DeviceAnswer answer, bool learns) : answer_(answer), learns_(learns) {}
  DeviceAnswer read(Eigen::Vector3d& /*position_m*/) noexcept override { return answer_; }
  DeviceStatus status() noexcept override {
    DeviceStatus status;
    status.failed = answer_ == DeviceAnswer::failed && !learned_;
    if (learned_) status.forces_off = ForcesOff::unplugged;
    return status;
  }
  bool learn_end() noexcept override {
    learned_ = learns_;
    return learns_;
  }

 private:
  DeviceAnswer answer_;
  bool learns_, learned_ = false;
};

ServoOutcome outcome_of_last_words(DeviceAnswer answer, bool learns) {
  LastWordsHandle device(answer, learns);
  ServoSettings settings;
  settings.phase_ends = {1000};
  EmptySpace empty(settings.period_s);
  return run_in_virtual_time(device, empty, settings, [](const ServoRecord&) {});
}

TEST_CASE("A lost connection is completed after the loop, and old positions are named") {
  CHECK(outcome_of_last_words(DeviceAnswer::failed, false).cause == StopCause::communication);
  CHECK(outcome_of_last_words(DeviceAnswer::failed, true).cause == StopCause::unplugged);
  const ServoOutcome late = outcome_of_last_words(DeviceAnswer::time_guard, false);
  CHECK(late.cause == StopCause::communication);
  CHECK_THAT(late.detail,
             Contains(fmt::format("positions older than {:g} ms", 1e3 * ServoStep::kMostStale_s)));
}

TEST_CASE("A check that the device ended quotes it, and does not blame the machine") {
  JitterCheck check = test::made_check(500.0);
  test::add_cycles(check, 30, 20'000);
  check.outcome.cause = StopCause::communication;
  check.outcome.detail = "positions older than 20 ms";
  check.outcome.device.error = 1;
  constexpr std::string_view kSaid = "device-disconnected";
  kSaid.copy(check.outcome.device.error_text, kSaid.size());
  check.findings = {{"in_use", "another client may use the device 049D"}};
  assess(check);
  const std::string text = check_text(check);
  CHECK_THAT(text, Contains("the device said: error 1 (device-disconnected)\n") &&
                       Contains("the device noticed: another client may use the device 049D\n") &&
                       Contains("communication error: positions older than 20 ms"));
  CHECK_THAT(text, !Contains("would help"));
  const Json json = check_json(check);
  CHECK(json.at("device_error_text").get<std::string>() == kSaid);
  CHECK(json.at("device_findings").at(0).at("code") == "in_use");
  check.outcome.cause = StopCause::overrun_storm;
  assess(check);
  CHECK_THAT(check.advice, Contains("would help"));
}

TEST_CASE("Torque scaling and a mount that is moved are set neutral or refused") {
  for (const char* setting : {"torque_scaling", "mount"}) {
    CAPTURE(setting);
    StandInFaults f;
    f.torque_scaling = std::string_view(setting) == "torque_scaling";
    if (!f.torque_scaling) {
      f.preset = "";
      f.settings_by_http = true;  // a preset would come with a mount of its own
      f.gate = 0.0;
      f.mounted_m = 0.02;
    }
    StandInInverse service(PlantSettings{}, {}, false, f);
    InverseDevice device(service.address(), limits_of("inverse3"));
    CHECK_THAT(fmt::format("{}", fmt::join(base::remark_texts(device.open().assumptions), "\n")),
               Contains("mount at 0 0 0 m") && Contains("torque scaling off"));
    CHECK(service.settings().torque_scaling == false);
    f.keeps = {setting};
    CHECK_THAT(refusal(f), Contains(f.torque_scaling ? "torque scaling of the service stays on"
                                                     : "moves coordinates: a mount by 0.02 m"));
  }
  StandInFaults old;
  old.version = "3.1.0.0";  // which has no request for it
  old.torque_scaling = true;
  CHECK_THAT(refusal(old), Contains("torque scaling of the service stays on"));
}

TEST_CASE("What a service does not say of gravity, and a mount of a preset, are findings") {
  StandInFaults f;
  f.names_no_gravity = true;
  f.mounted_m = 0.02;
  StandInInverse service(PlantSettings{}, {}, false, f);
  InverseDevice device(service.address(), limits_of("inverse3"));
  (void)device.open();
  const std::vector<DeviceFinding> found = device.findings();
  REQUIRE(found.size() == 2);
  CHECK(found[0].code == "gravity_not_reported");
  CHECK_THAT(found[0].text, Contains("does not name gravity compensation: it is unknown"));
  CHECK(found[1].code == "mount_beside_preset");
  CHECK_THAT(found[1].text, Contains("mount at 0.02 0 0 m beside the preset 'arm_front_centered'"));
}

TEST_CASE("An inventory that cannot be read and no events are of the environment, with the port") {
  StandInFaults f;
  f.no_inventory_json = true;
  StandInInverse service(PlantSettings{}, {}, false, f);
  try {
    (void)inverse_inventory(service.address());
    FAIL("it was read");
  } catch (const Error& error) {
    CHECK(error.code() == ExitCode::environment);
    CHECK_THAT(error.what(), Contains(fmt::format("inverse3: 127.0.0.1:{}: the inventory cannot "
                                                  "be read",
                                                  service.port())));
  }
  CHECK_THAT(refusal(f), Contains("the inventory cannot be read"));
  f = {};
  f.no_events = true;
  CHECK_THAT(refusal(f), Contains("no events are heard") && Contains("--inverse-events-port"));
}

}  // namespace
}  // namespace tpm::haptics
