// Findings of a device: told once by their code, and while tpm hil check or identify runs.
#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <optional>
#include <string>
#include <vector>

#include "inverse_clients.hpp"
#include "inverse_sessions.hpp"
#include "shaken_contact.hpp"
#include "tpm/haptics/serve/inverse_server.hpp"
#include "tpm/haptics/session/finding_notices.hpp"
#include "tpm/haptics/session/identify_run.hpp"
#include "tpm/haptics/session/jitter_check.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {
namespace {

using namespace test::inverse_sessions;

/// Has findings that the test sets.
class FindingHandle final : public test::Puppet {
 public:
  std::vector<DeviceFinding> findings() const override { return found; }

  std::vector<DeviceFinding> found;
};

TEST_CASE("Findings are told apart by their code, whatever their words begin with") {
  FindingHandle device;
  std::vector<std::string> told;
  FindingNotices notices(device,
                         [&told](const DeviceFinding& finding) { told.push_back(finding.text); });
  notices.look();
  CHECK(told.empty());
  device.found = {{"slow", "the handle is late by 1 ms"}, {"weak", "the handle is late by 2 N"}};
  notices.look();
  CHECK(told ==
        std::vector<std::string>{"the handle is late by 1 ms", "the handle is late by 2 N"});
  device.found[0].text = "3 ms late, at 12:00";
  notices.look();
  CHECK(told.size() == 2);
  FindingNotices(device, {}).look();  // nobody is told
}

/// A device that somebody pushes with 1 N, whatever is commanded.
class PushedByAnother final : public ServedHand {
 public:
  InverseState state() noexcept override {
    InverseState state;
    state.force_N = {0.0, 0.0, 1.0};
    return state;
  }
  void push(const Eigen::Vector3d& /*force_N*/) noexcept override {}
  void move_to(const std::optional<Eigen::Vector3d>& /*position_m*/) noexcept override {}
  void let_go() noexcept override {}
};

DeviceChoice device_of(const InverseServer& server) {
  DeviceChoice choice;
  choice.kind = "inverse3";
  choice.inverse = {server.port(), server.events_port(), server.port(), ""};
  return choice;
}

/// Slow, with a device and a loop that wait for a machine that stalls.
HilSession waiting_session() {
  HilSession session;
  session.servo.period_s = 0.01;
  session.preparation.watchdog_s = 10.0;
  session.cycle_timeout_s = 60.0;
  return session;
}

TEST_CASE("A check tells of another client while it runs, as a session does") {
  PushedByAnother hand;
  const InverseServer server(hand, test::neutral_server());
  const DeviceChoice choice = device_of(server);
  const HilSession session = waiting_session();
  std::vector<std::string> told;  // by the thread that writes records
  std::atomic<bool> heard{false};
  JitterCheck check;
  // Where the machine stalls, late states may end a check before the difference has lasted.
  constexpr int kMostTries = 100;
  for (int i = 0; i < kMostTries && !heard; ++i) {
    check = check_jitter(
        choice, session, 600.0, RealTimeWish::ignore, [&heard] { return heard.load(); },
        [&](const DeviceFinding& finding) {
          told.push_back(finding.code);
          heard = true;
        });
  }
  CHECK(told == std::vector<std::string>{"force_without_command"});
  CHECK(check.outcome.cause != StopCause::finished);
  REQUIRE(check.findings.size() == 1);
  CHECK(check.findings.front().code == "force_without_command");
}

TEST_CASE("An identification tells of another client while it runs, and once") {
  PushedByAnother hand;
  const InverseServer server(hand, test::neutral_server());
  std::vector<std::string> told;  // by the thread that writes records
  std::atomic<bool> heard{false};
  DeviceIdentifyOptions options;
  options.duration_s = 600.0;
  options.real_time = true;
  options.interrupted = [&heard] { return heard.load(); };
  options.noticed = [&](const DeviceFinding& finding) {
    told.push_back(finding.code);
    heard = true;
  };
  IdentifyRun run;
  // Where the machine stalls, late states may end it before the difference has lasted.
  constexpr int kMostTries = 100;
  for (int i = 0; i < kMostTries && !heard; ++i) {
    run = run_identification(device_of(server), waiting_session(), options);
  }
  REQUIRE_FALSE(told.empty());
  CHECK(run.outcome.cause == StopCause::signal);
  CHECK(std::ranges::count(told, told.front()) == 1);
  CHECK(std::ranges::any_of(run.findings, [&told](const DeviceFinding& finding) {
    return finding.code == told.front();
  }));
}

TEST_CASE("A check tells before it begins that a device may be in use") {
  test::StandInFaults faults;
  faults.simulated = false;
  faults.in_use = true;
  test::StandInInverse service(PlantSettings{}, {}, true, faults);
  std::vector<std::string> told;
  const JitterCheck check =
      check_jitter(choice_of(service), HilSession{}, 0.1, RealTimeWish::ignore, {},
                   [&told](const DeviceFinding& finding) { told.push_back(finding.code); });
  CHECK(std::ranges::count(told, "in_use") == 1);
  CHECK(check.findings.front().code == "in_use");
}

}  // namespace
}  // namespace tpm::haptics
