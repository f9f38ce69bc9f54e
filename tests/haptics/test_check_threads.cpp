// tpm hil check: the time that machine and device keep, and the gate of the session that is named.
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>

#include "hil_scenes.hpp"
#include "made_check.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/force_dimension.hpp"
#include "tpm/haptics/session/jitter_check.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpmkit/session.hpp"
#include "vendor_script.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

/// The stand-in library with a script, for as long as this lives.
class CheckedStandIn : public test::VendorScript {
 public:
  explicit CheckedStandIn(const std::string& lines)
      : VendorScript("watchdog_by_clock 0\n" + lines) {}

  /// Its device, with a file in which one key is another.
  [[nodiscard]] DeviceChoice with_file(const char* key, const Json& value) const {
    DeviceChoice device = test::stand_in_choice();
    Json changed = read_json(device.file);
    changed[key] = value;
    device.file = file("device.json");
    write_file(device.file, to_text(changed));
    return device;
  }
};

DeviceChoice device_without_a_file() {
  return test::stand_in_choice("");
}

/// Exit code of `tpm hil check`, its answer and its message.
struct CheckAnswer {
  int exit_code = -1;
  std::string text, error;
};

CheckAnswer answer_of_check(const std::string& arguments) {
  const test::TempFolder folder;
  const std::string said = folder / "said", error = folder / "error";
  const int status = std::system(
      ("'" TPM_TEST_PROGRAM "' hil check " + arguments + " > '" + said + "' 2> '" + error + "'")
          .c_str());
  REQUIRE(WIFEXITED(status));
  const auto content = [](const std::string& file) {  // which may be empty
    std::ifstream lines(file);
    return std::string(std::istreambuf_iterator<char>(lines), {});
  };
  return {WEXITSTATUS(status), content(said), content(error)};
}

TEST_CASE("A check gives a cycle as long as its session does") {
  HilSession session;
  session.cycle_timeout_s = 30.0;
  CHECK(real_time_options(session, RealTimeWish::ignore, {}).cycle_timeout_s == 30.0);
  session.servo.most_late = 1001;
  session.servo.most_missed = 1'000'000;
  const CheckedStandIn stand_in("fault hang 100 2000\n");
  const JitterCheck check =
      check_jitter(device_without_a_file(), session, 0.5, RealTimeWish::ignore);
  CHECK(stand_in.happened("hang_over"));
  CHECK(check.outcome.cause == StopCause::finished);
  CHECK(check.outcome.busy.max_s() >= 2.0);
  CHECK(check.cycle_timeout_s == 30.0);
  // Of 2000 ms, or longer if the machine stalls where the call ends.
  CHECK_THAT(check.timing, Contains("not kept: a stall of ") && Contains(" leaves "));
}

TEST_CASE("A check in which a cycle hangs counts the cycles before it") {
  HilSession session;
  session.cycle_timeout_s = 0.5;
  JitterCheck check;
  bool hung = false;
  // A machine that stalls for half a second itself ends a check before the call hangs.
  for (int tries = 0; tries < 5 && !hung; ++tries) {
    const CheckedStandIn stand_in("fault hang 300 2000\n");
    check = check_jitter(device_without_a_file(), session, 60.0, RealTimeWish::ignore);
    // The thread that is left behind has come back before its library gets another script.
    hung = stand_in.happened("hang");
    for (int wait = 0; wait < 1000 && hung && !stand_in.happened("hang_over"); ++wait) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    REQUIRE(stand_in.happened("hang_over") == hung);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  REQUIRE(hung);
  const ServoOutcome& o = check.outcome;
  REQUIRE(o.cause == StopCause::cycle_timeout);
  CHECK(o.cycles > 0);
  // Every period had a cycle or was missed.
  CHECK(o.woke_late.count() + o.counts.missed == o.cycles);
  CHECK(o.busy.count() == o.woke_late.count() + 1);
  CHECK(o.busy.max_s() >= 0.5);
  const std::string text = check_text(check);
  CHECK_THAT(text, Contains("extrapolated, not measured: nothing, because a cycle hung\n"));
  CHECK_THAT(text, Contains(", and a cycle that hung\n"));
  CHECK_THAT(text, !Contains("too short") && !Contains("not counted"));
  CHECK_THAT(check.advice, Contains("a cycle did not end within 500 ms"));
  const Json json = check_json(check);
  CHECK(json.at("stalls").at("upper_95_per_s").is_null());
  CHECK(json.at("stalls").at("once_an_hour_extrapolated_s").is_null());
  CHECK(json.at("woke_late").is_object());
}

TEST_CASE("Of a loop whose first cycle hung nothing is counted, and nothing is said of stalls",
          "[untimed]") {
  JitterCheck check = test::made_check();
  check.outcome.cause = StopCause::cycle_timeout;
  assess(check);
  CHECK(check.timing == "not kept: the test ended early: cycle timeout");
  CHECK_THAT(check.advice, Contains("nothing is known of what this machine can do"));
  const std::string text = check_text(check);
  CHECK_THAT(text, Contains("stalls beyond the watchdog: not counted\n"));
  CHECK_THAT(text, Contains("woke after the deadline: not counted\n"));
  const Json json = check_json(check);
  CHECK(json.at("stalls").at("beyond_watchdog").is_null());
  CHECK(json.at("stalls").at("upper_95_per_s").is_null());
  CHECK(json.at("woke_late").is_null());
}

TEST_CASE("A check refuses the file of another device before a force") {
  const CheckedStandIn stand_in("");
  const auto refusal = [](const DeviceChoice& device) {
    return test::refusal_of(
        [&] { (void)check_jitter(device, HilSession{}, 0.1, RealTimeWish::ignore); });
  };
  CHECK_THAT(refusal(stand_in.with_file("serial", "1")),
             Contains("was measured on the device '1', and this is '4711'"));
  CHECK(stand_in.happened("open"));
  CHECK(stand_in.happened("close"));
  CHECK_FALSE(stand_in.happened("thread_of_forces_on"));
  CHECK_THAT(refusal(stand_in.with_file("device", "falcon")),
             Contains("key /device: is of 'falcon', not of 'omega7'"));
}

TEST_CASE("A check says to a session what its run says") {
  const CheckedStandIn stand_in("");
  const auto asked = [](const HilSession& session, const DeviceChoice& device) {
    return ask_session_gate(session, device, RealTimeWish::ignore);
  };
  const HilSession session = test::parsed(test::short_session());
  SessionRunOptions options;
  options.real_time = true;
  options.recording = stand_in.file("r");

  // What nobody measured counts as 20 ms late; a workspace may be too small.
  for (const DeviceChoice& device :
       {device_without_a_file(), stand_in.with_file("limits", {{"reach_m", 0.01}})}) {
    const SessionVerdict verdict = asked(session, device);
    CHECK_FALSE(verdict.accepted);
    CHECK_FALSE(verdict.words.empty());
    CHECK(verdict.words == test::refusal_of([&] { (void)run_session(session, device, options); }));
  }
  CHECK_THAT(asked(session, device_without_a_file()).words,
             Contains("stability: a weakly damped hand would receive energy"));

  // The check of a second is part of it, and compares the serial number.
  CHECK_THAT(test::refusal_of([&] { (void)asked(session, stand_in.with_file("serial", "1")); }),
             Contains("was measured on the device '1', and this is '4711'"));

  options.real_time = false;
  const SessionVerdict rehearsed = asked(session, DeviceChoice{});
  const SessionRun run = run_session(session, DeviceChoice{}, options);
  CHECK(rehearsed.accepted);
  CHECK(rehearsed.words == run.rendering.verdict());
  REQUIRE(rehearsed.on_hardware);
  CHECK(rehearsed.on_hardware->verdict() == run.on_hardware->verdict());
  CHECK(rehearsed.hardware_kind == "omega7");
}

TEST_CASE("Text and JSON of a check say the same of time and session") {
  JitterCheck check = test::made_check();
  test::add_cycles(check, 60'000, 19'500);
  assess(check);
  CHECK_THAT(check_text(check), Contains("session: none was named"));
  CHECK(check_json(check).at("session").is_null());

  check.session = ask_session_gate(test::parsed(test::short_session()), device_without_a_file(),
                                   RealTimeWish::ignore);
  const std::string text = check_text(check);
  const Json json = check_json(check);
  CHECK(json.at("timing_kept") == true);
  CHECK_THAT(text, Contains("timing: " + json.at("timing").get<std::string>() + "\n"));
  const Json& session = json.at("session");
  CHECK(session.at("accepted") == false);
  CHECK_THAT(text, Contains("session: short: refused: " + session.at("verdict").get<std::string>() +
                            "\n"));
}

TEST_CASE("The answer of a check has 25 lines at most, its verdicts first") {
  JitterCheck check = test::made_check();
  for (int power = 0; power < 14; ++power) test::add_cycles(check, 1, 1'000LL << power);
  check.findings.push_back({"told", "something that the device tells"});
  assess(check);
  check.session = ask_session_gate(test::parsed(test::short_session()), device_without_a_file(),
                                   RealTimeWish::ignore);
  const auto lines = [](const std::string& text) { return std::ranges::count(text, '\n'); };
  REQUIRE(lines(check_text(check)) > 25);  // with the histogram
  show::ShortAnswer answer = short_answer(check);
  show::end_answer(answer, "", {}, "tpm hil run session.json");
  const std::string text = show::to_text(answer);
  INFO(text);
  CHECK(lines(text) <= 25);
  CHECK(text.starts_with("timing: " + check.timing + "\nsession: short: refused: "));
  CHECK_THAT(text, Contains("\n! the device noticed: something that the device tells\n") &&
                       Contains("\n" + check.advice + "\n") && Contains(" cycles, ") &&
                       Contains("watchdog 8 ms"));
  CHECK(text.ends_with("\nmore: --verbose; next: tpm hil run session.json\n"));
}

TEST_CASE("tpm hil check ends as tpm hil run does where that refuses") {
  const CheckedStandIn stand_in("");
  write_file(stand_in.file("s.json"), to_text(test::short_session()));
  const std::string session = "'" + stand_in.file("s.json") + "' --duration '0.1 s' ";
  const std::string device = "--device omega7 --dhd-library '" TPM_STAND_IN_DHD "' ";
  const CheckAnswer refused = answer_of_check(session + device);
  CHECK(refused.exit_code == 1);
  CHECK_THAT(refused.text, Contains("\nsession: short: refused: stability: a weakly damped hand"));
  const CheckAnswer json = answer_of_check(session + device + "--format json");
  CHECK(json.exit_code == 1);
  CHECK(Json::parse(json.text).at("session").at("accepted") == false);

  const std::string other = stand_in.with_file("serial", "1").file.string();
  const CheckAnswer of_another =
      answer_of_check("--duration '0.1 s' " + device + "--device-file '" + other + "'");
  CHECK(of_another.exit_code == 5);
  CHECK_THAT(of_another.error, Contains("was measured on the device '1', and this is '4711'"));

  // What would not be used is refused.
  CHECK(answer_of_check("--duration '0.1 s' --device-file '" + other + "'").exit_code == 2);
  CHECK(answer_of_check(session + "--loop-rate '2 kHz'").exit_code == 2);
}

TEST_CASE("A session of a C++ program compares the file with the device that it is given") {
  const CheckedStandIn stand_in("clock 1\n");
  write_file(stand_in.file("s.json"), to_text(test::short_session()));
  const Session session(stand_in.file("s.json"));
  const auto refusal = [&](const char* serial) {
    SessionRequest request;
    request.recording = stand_in.file("r");
    request.device_file = stand_in.with_file("serial", serial).file;
    const auto device =
        std::make_shared<ForceDimension>(TPM_STAND_IN_DHD, "omega7", DeviceSelection{});
    return test::refusal_of([&] { (void)session.run(device, request); });
  };
  CHECK_THAT(refusal("1"), Contains("was measured on the device '1', and this is '4711'"));
  CHECK_FALSE(stand_in.happened("thread_of_forces_on"));
  CHECK_THAT(refusal("4711"), Contains("a device with motors keeps the clock"));
  // A simulated device stands for that of the file.
  SessionRequest request;
  request.recording = stand_in.file("r");
  request.limits = "omega7";
  request.device_file = stand_in.with_file("serial", "1").file;
  CHECK(session.run(session.simulated_device(), request).outcome.cause == StopCause::finished);
}

}  // namespace
}  // namespace tpm::haptics
