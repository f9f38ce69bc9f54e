// The servo loop on the clock, with its threads: hang, signal, kill -9. What is asserted holds on a
// machine that other programs stall; how soon forces are off is measured (measure_hazards).

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "hil_scenes.hpp"
#include "operator_lines.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/empty_space.hpp"
#include "tpm/haptics/session/identify_run.hpp"
#include "tpm/haptics/session/jitter_check.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpmkit/error.hpp"
#include "vendor_script.hpp"

namespace tpm::haptics {
namespace {

using namespace std::chrono_literals;

/// Loads of other programs must not stop what is not about them.
HilSession patient_session() {
  HilSession session = test::parsed(test::short_session());
  session.servo.most_late = 1001;
  session.servo.most_missed = 1'000'000;
  session.cycle_timeout_s = 10.0;
  return session;
}

/// A hand that is where a session can begin, and then does what it asks.
std::string hand_in_place(const test::TempFolder& folder) {
  write_file(folder / "operator", to_lines(test::parsed(test::short_session()).operator_script()));
  return "operator " + (folder / "operator") + "\nwait 250\n";
}

SessionRunOptions on_the_clock(const std::string& file) {
  SessionRunOptions options;
  options.real_time = true;
  options.check_delay = false;  // calls are counted
  options.recording = file;
  return options;
}

TEST_CASE("On the clock a session takes its time, and every cycle is recorded or counted") {
  const test::TempFolder folder;
  Json json = test::short_session();
  json.erase("creep");
  json["indentations"]["rates"] = {"20 mm/s"};
  json["indentations"]["hold"] = "0.2 s";
  json["indentations"]["rest"] = "0.1 s";
  HilSession session = test::parsed(json);
  session.servo.most_late = 1001;
  session.servo.most_missed = 1'000'000;
  session.cycle_timeout_s = 10.0;
  session.plant.watchdog_s = session.preparation.watchdog_s = 0.016;
  const auto start = std::chrono::steady_clock::now();
  const SessionRun run = run_session(session, {}, on_the_clock(folder / "r"));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const HilRecording recording = read_recording(folder / "r");
  // A machine that is stalled for longer than the watchdog waits ends the session early.
  if (run.outcome.cause == StopCause::finished) {
    CHECK(took.count() > 0.99 * session.duration_s());
  }
  CHECK_FALSE(run.outcome.scheduling.empty());
  CHECK(run.outcome.dropped_records == 0);
  CHECK((run.outcome.cause == StopCause::finished || run.outcome.cause == StopCause::watchdog));
  // Missed periods are time too: rows and missed ones together are the cycles. A stall while the
  // hand was awaited leaves one row, and no cycle.
  REQUIRE_FALSE(recording.rows.empty());
  const bool begun = recording.rows.back().phase >= 0;
  std::uint64_t lived = 0;
  for (const ServoRecord& row : recording.rows) lived += 1 + static_cast<std::uint64_t>(row.missed);
  CHECK(run.outcome.cycles + 1 == (begun ? lived : recording.rows.size()));
}

TEST_CASE("A session on the clock that is interrupted stops safely and is whole") {
  const test::TempFolder folder;
  std::atomic<bool> stop{false};
  SessionRunOptions options = on_the_clock(folder / "r");
  options.interrupted = [&] { return stop.load(); };
  std::thread later([&] {
    std::this_thread::sleep_for(200ms);
    stop = true;
  });
  const SessionRun run = run_session(patient_session(), {}, options);
  later.join();
  const bool cut_by_load = run.outcome.cause == StopCause::watchdog;  // the machine was stalled
  CHECK((run.outcome.cause == StopCause::signal || cut_by_load));
  CHECK(read_recording(folder / "r").closed);
}

TEST_CASE("A device that is not the one of its file gets no force, not even for the check before") {
  const test::TempFolder folder;
  const test::VendorScript script(hand_in_place(folder));
  const DeviceChoice device = test::stand_in_choice(folder / "device.json");
  Json file = read_json(TPM_TEST_SOURCE_DIR "/tests/fixtures/stand_in_device.json");
  file["serial"] = "1";
  write_file(device.file, to_text(file));
  SessionRunOptions options = on_the_clock(folder / "r");
  options.check_delay = true;
  CHECK_THROWS_WITH(run_session(patient_session(), device, options),
                    Catch::Contains("was measured on the device '1', and this is '4711'"));
  CHECK(script.event_ns("open") > 0);
  CHECK(script.event_ns("close") > 0);
  CHECK(script.event_ns("thread_of_forces_on") == -1);
}

TEST_CASE("A device with motors is not driven in virtual time") {
  const test::TempFolder folder;
  const test::VendorScript script(hand_in_place(folder) + "clock 1\n");
  SessionRunOptions options;
  options.recording = folder / "r";
  CHECK_THROWS_WITH(run_session(patient_session(), test::stand_in_choice(), options),
                    Catch::Contains("a device with motors keeps the clock; expected --clock real"));
  CHECK(script.event_ns("close") > 0);
  CHECK(script.event_ns("thread_of_forces_on") == -1);
  CHECK_FALSE(std::filesystem::exists(folder / "r"));
}

TEST_CASE("A call that hangs: forces are off before it ends, the cause is told") {
  bool seen = false;
  for (int attempt = 0; attempt < 10 && !seen; ++attempt) {
    const test::TempFolder folder;
    const test::VendorScript script(hand_in_place(folder) + "fault hang 350 2000\n");
    HilSession session = patient_session();
    session.cycle_timeout_s = 0.006;
    const SessionRun run =
        run_session(session, test::stand_in_choice(), on_the_clock(folder / "r"));
    if (run.outcome.cause == StopCause::watchdog) continue;  // the machine was stalled
    REQUIRE(run.outcome.cause == StopCause::cycle_timeout);
    const HilRecording recording = read_recording(folder / "r");
    CHECK(recording.closed);
    CHECK(recording.closing.at("cause") == "cycle timeout");
    const long long hung = script.event_ns("hang"), off = script.event_ns("forces_off");
    if (hung > 0 && off > hung) {  // else the machine itself hung before
      seen = true;
      CHECK(1e-9 * static_cast<double>(off - hung) < 2.0);  // the call itself takes as long
      CHECK(recording.rows.size() >= 90);                   // nothing before it is lost
    }
    // The stuck thread ends before its library gets another script.
    for (int wait = 0; wait < 100 && hung > 0 && script.event_ns("hang_over") < 0; ++wait) {
      std::this_thread::sleep_for(50ms);
    }
    std::this_thread::sleep_for(300ms);
  }
  if (!seen) WARN("the machine stalled before the call did, 10 times");
}

/// A session on the stand-in, interrupted 0.3 s after it began to read, however late that is.
SessionRun short_run_on_stand_in(const test::TempFolder& folder, const test::VendorScript& script,
                                 std::atomic<int>* cycles = nullptr) {
  SessionRunOptions options = on_the_clock(folder / "r");
  options.interrupted = [&script, after = std::chrono::steady_clock::time_point::max()]() mutable {
    const auto now = std::chrono::steady_clock::now();
    if (script.event_ns("thread_of_first_read") > 0) after = std::min(after, now + 300ms);
    return now > after;
  };
  if (cycles != nullptr) {
    options.watcher = [cycles](const ServoRecord& row) {
      if (row.stop == StopCause::none) ++*cycles;
    };
  }
  return run_session(patient_session(), test::stand_in_choice(), options);
}

TEST_CASE(
    "The device is prepared when all threads are there, and the loop's thread enables forces") {
  const test::TempFolder folder;
  const test::VendorScript script(hand_in_place(folder) + "watchdog_by_clock 0\n");
  (void)short_run_on_stand_in(folder, script);
  // The caller's, the loop's and that of the records.
  CHECK(script.event_ns("threads_when_prepared") >= 3);
  CHECK(script.event_ns("thread_of_forces_on") > 0);
  CHECK(script.event_ns("thread_of_forces_on") == script.event_ns("thread_of_first_read"));
}

TEST_CASE("A device whose watchdog counts by the clock lets a session begin") {
  // A machine that stalls for 8 ms ends a session; the start does not. After it the loop serves
  // some cycles at least, also on a busy machine.
  constexpr int kSome = 5;
  std::atomic<int> cycles{0};
  for (int attempt = 0; attempt < 10 && cycles < kSome; ++attempt) {
    const test::TempFolder folder;
    const test::VendorScript script(hand_in_place(folder));
    cycles = 0;
    (void)short_run_on_stand_in(folder, script, &cycles);
  }
  CHECK(cycles >= kSome);
}

TEST_CASE("In real time the watchdog of the simulated device counts by the clock") {
  const HilSession session = patient_session();
  VirtualOmega7 device(session.plant, session.operator_script());
  DevicePreparation preparation = session.preparation;
  const auto cause_after_20_ms = [&] {
    device.prepare(preparation);
    std::this_thread::sleep_for(20ms);  // forces are off: nothing counts
    CHECK(device.status().forces_off == ForcesOff::software);
    device.enable_forces();
    std::this_thread::sleep_for(20ms);
    (void)device.write(Eigen::Vector3d::Zero());
    return device.status().forces_off;
  };
  CHECK(cause_after_20_ms() == ForcesOff::none);
  preparation.real_time = true;
  CHECK(cause_after_20_ms() == ForcesOff::watchdog);
}

TEST_CASE(
    "A stall stands in the record with its whole length, and agrees with the missed periods") {
  const test::TempFolder folder;
  const test::VendorScript script(hand_in_place(folder) +
                                  "watchdog_by_clock 0\nfault hang 350 30\n");
  const HilSession session = patient_session();
  SessionRunOptions options = on_the_clock(folder / "r");
  // Half a second after the call hung; or when the session is over.
  options.interrupted = [&, after = std::chrono::steady_clock::time_point::max()]() mutable {
    const auto now = std::chrono::steady_clock::now();
    if (script.event_ns("hang_over") > 0) after = std::min(after, now + 500ms);
    return now > after;
  };
  (void)run_session(session, test::stand_in_choice(), options);
  const HilRecording recording = read_recording(folder / "r");
  const double period_s = session.servo.period_s;
  double longest_s = 0.0;
  for (const ServoRecord& row : recording.rows) {
    INFO("cycle " << row.cycle << " woke late by " << row.woke_late_s << " s");
    CHECK(row.woke_late_s >= (1.0 - 1e-6) * row.missed * period_s);
    CHECK(row.woke_late_s <= (1.0 + 1e-6) * (row.missed + 1) * period_s);
    longest_s = std::max(longest_s, static_cast<double>(row.woke_late_s));
  }
  CHECK(longest_s > 0.030 - 2.0 * period_s);
}

TEST_CASE("Slow calls of the device end in a safe stop with the overrun storm as its cause") {
  const test::TempFolder folder;
  const test::VendorScript script(hand_in_place(folder) +
                                  "watchdog_by_clock 0\nfault slow 350 100000\n");
  HilSession session = patient_session();
  session.servo.most_late = 20;
  const SessionRun run = run_session(session, test::stand_in_choice(), on_the_clock(folder / "r"));
  REQUIRE(run.outcome.cause == StopCause::overrun_storm);
  const HilRecording recording = read_recording(folder / "r");
  CHECK(recording.closing.at("cause") == to_string(StopCause::overrun_storm));
  REQUIRE_FALSE(recording.rows.empty());
  CHECK(recording.rows.back().stop == StopCause::overrun_storm);
  // One late cycle more than the session allows, each of them seen. The machine itself may have
  // been late before the session began, in cycles that are not recorded.
  const auto late = [](const ServoRecord& row) { return (row.flags & kLate) != 0; };
  const auto seen = std::count_if(recording.rows.begin(), recording.rows.end(), late);
  CHECK(seen >= 1);
  CHECK(seen <= 21);
  CHECK(script.event_ns("forces_off") > 0);
}

TEST_CASE("Whatever throws while a session runs, its threads end and the forces are off") {
  class Free final : public EmptySpace {
   public:
    ContactAnswer step(const ToolPose&) noexcept override { return {}; }
  };
  HilSession session = patient_session();
  session.servo.gate.reset();
  session.plant.least_watchdog_s = 10.0;
  const auto device = std::make_shared<VirtualOmega7>(session.plant, session.operator_script());
  RealTimeOptions options;
  options.cycle_timeout_s = 5.0;
  const RecordSink quiet = [](const ServoRecord&) {};

  device->prepare(session.preparation);
  options.interrupted = []() -> bool { throw Error(ExitCode::environment, "asking", "failed"); };
  CHECK_THROWS_WITH(run_in_real_time(device, std::make_shared<Free>(), ServoSettings{session.servo},
                                     quiet, options),
                    Catch::Contains("asking: failed"));
  CHECK(device->status().forces_off == ForcesOff::software);

  device->prepare(session.preparation);
  options.interrupted = {};
  const ServoOutcome no_error = run_in_real_time(
      device, std::make_shared<Free>(), ServoSettings{session.servo},
      [](const ServoRecord& row) {
        if (row.cycle >= 50) throw 7;  // NOLINT: what is no error; a missed period has no row
      },
      options);
  CHECK(no_error.cause == StopCause::exception);
  CHECK_FALSE(no_error.detail.empty());
  CHECK(device->status().forces_off == ForcesOff::software);

  device->prepare(session.preparation);
  CHECK(run_in_virtual_time(*device, *std::make_shared<Free>(), ServoSettings{session.servo},
                            [](const ServoRecord&) { throw 7; })
            .cause == StopCause::exception);
  CHECK(device->status().forces_off == ForcesOff::software);
}

TEST_CASE("What goes through a triple buffer arrives whole, in order, the last one at last") {
  struct Value {
    long number = 0, negative = 0, twice = 0;
  };
  constexpr long kLast = 200'000;
  TripleBuffer<Value> buffer;
  std::thread writer([&] {
    for (long i = 1; i <= kLast; ++i) buffer.write({i, -i, 2 * i});
  });
  long seen = 0, broken = 0;
  while (seen < kLast) {
    if (!buffer.refresh()) continue;
    const Value& value = buffer.latest();
    if (value.negative != -value.number || value.twice != 2 * value.number) ++broken;
    if (value.number <= seen) ++broken;
    seen = value.number;
  }
  writer.join();
  CHECK(broken == 0);
  CHECK_FALSE(buffer.refresh());
}

TEST_CASE("The jitter check counts and reports") {
  DeviceChoice device;
  HilSession session;
  session.servo.period_s = 2e-3;
  const JitterCheck check = check_jitter(device, session, 0.5, RealTimeWish::ignore);
  CHECK_THAT(check.device.assumptions.back().text,
             Catch::Contains("a watchdog that waits 1 s at least"));
  CHECK(check.watchdog_s == session.preparation.watchdog_s);
  CHECK(check.outcome.woke_late.count() > 0);
  CHECK_FALSE(check.timing.empty());
}

TEST_CASE("A machine that stalls does not end an identification by the simulated watchdog") {
  HilSession session;
  session.servo.period_s = 2e-3;
  DeviceIdentifyOptions options;
  options.duration_s = 1.0;
  options.real_time = true;
  const IdentifyRun run = run_identification(DeviceChoice{}, session, options);
  CHECK(run.outcome.cause != StopCause::watchdog);
  CHECK_THAT(run.device.assumptions.back().text,
             Catch::Contains("a watchdog that waits 1 s at least"));
}

TEST_CASE("Quantiles of times are the upper edges of their bins, and beyond the bins the largest",
          "[untimed]") {
  TimeHistogram times;
  for (int i = 0; i < 50; ++i) times.note(500);
  for (int i = 0; i < 49; ++i) times.note(10'500);
  times.note(60'000'000);
  CHECK(times.count() == 100);
  CHECK_THAT(times.quantile_s(0.5), Catch::Matchers::WithinRel(1e-6, 1e-12));
  CHECK_THAT(times.quantile_s(0.51), Catch::Matchers::WithinRel(11e-6, 1e-12));
  CHECK_THAT(times.quantile_s(0.99), Catch::Matchers::WithinRel(11e-6, 1e-12));
  CHECK_THAT(times.quantile_s(1.0), Catch::Matchers::WithinRel(0.06, 1e-12));
  CHECK_THAT(times.max_s(), Catch::Matchers::WithinRel(0.06, 1e-12));
}

TEST_CASE("The jitter check says no where a session with the same limits would have been stopped",
          "[untimed]") {
  JitterCheck check;
  check.rate_Hz = 4000.0;
  check.watchdog_s = check.cycle_timeout_s = 0.008;
  check.late_limit = 100;
  check.missed_limit = 50;
  ServoOutcome& o = check.outcome;
  o.cause = StopCause::finished;
  o.cycles = 40'000;
  for (int i = 0; i < 40'000; ++i) o.woke_late.note(30'000);
  o.counts.missed = o.counts.most_consecutive_missed = 3;
  assess(check);
  CHECK(check.timing_kept);
  CHECK(check.timing ==
        "kept 4000 Hz for 10 s; stalls beyond the watchdog: fewer than 1080 an hour with 95 % (3/T "
        "of 10 s); extrapolated, not measured: 0.031 ms once an hour");
  CHECK_THAT(check.advice, Catch::Contains("can do 4000 Hz; its longest stall was 0.03 ms"));

  // One stall of 17 ms in ten seconds: 68 periods, 0.17 % of all.
  o.counts.missed = o.counts.most_consecutive_missed = 68;
  assess(check);
  CHECK_FALSE(check.timing_kept);
  CHECK_THAT(check.timing,
             Catch::Contains("68 consecutive periods were missed, a session stops after 50"));
  o.woke_late.note(17'000'000);
  assess(check);
  CHECK_THAT(check.timing,
             Catch::Contains("a stall of 17 ms leaves 17.2 ms without a command, the watchdog cuts "
                             "the forces after 8 ms"));
  CHECK_THAT(check.advice, Catch::Contains("longer than any watchdog of the device"));

  check.outcome = ServoOutcome{};
  o.cause = StopCause::finished;
  o.cycles = 40'000;
  o.counts.most_late = 101;
  assess(check);
  CHECK_THAT(check.timing,
             Catch::Contains("101 cycles of 1000 were late, a session stops after 100"));
  o.counts.most_late = 100;
  o.counts.missed = 900;
  assess(check);
  CHECK_THAT(check.timing, Catch::Contains("2.25 % of the periods were missed"));
  check.outcome = ServoOutcome{};
  o.cause = StopCause::finished;
  o.cycles = 1000;
  for (int i = 0; i < 1000; ++i) o.woke_late.note(300'000);
  assess(check);
  CHECK_THAT(check.timing, Catch::Contains("more than half a period"));
  CHECK_THAT(check.advice, Catch::Contains("can do 1000 Hz; a lower"));
}

}  // namespace
}  // namespace tpm::haptics
