// What a recording tells beside the forces: markers, clocks, and whether a hand feels anything.
#include <poll.h>
#include <pty.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <functional>
#include <memory>

#include "hil_scenes.hpp"
#include "made_check.hpp"
#include "temp_folder.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/haptics/session/enter_key.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/show/hil_report.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

/// The simulated device, with buttons that are pressed when a test says.
class Pressed final : public VirtualOmega7 {
 public:
  explicit Pressed(const HilSession& session)
      : VirtualOmega7(session.plant, session.operator_script()) {}
  HandState hand() noexcept override {
    HandState state;
    state.buttons = buttons;
    return state;
  }

  std::uint32_t buttons = 0;
};

/// Cycles with the flag of a marker.
std::vector<std::uint64_t> marked_in(const HilRecording& recording) {
  std::vector<std::uint64_t> cycles;
  for (const ServoRecord& row : recording.rows) {
    if ((row.flags & kMarked) != 0) cycles.push_back(row.cycle);
  }
  return cycles;
}

TEST_CASE("A button that goes down and a key set a marker, in the row and in the closing record") {
  const HilSession session = test::parsed(
      test::with(test::short_session(), "/start", {{"confirm", true}, {"limit", "2 s"}}));
  const test::TempFolder folder;
  const auto device = std::make_shared<Pressed>(session);
  const auto keys = std::make_shared<std::atomic<std::uint32_t>>(0);
  SessionRunOptions options;
  options.recording = folder / "r";
  options.markers = keys;
  // The button that begins the session stays down for 0.2 s and is no marker.
  options.watcher = [&](const ServoRecord& row) {
    if (row.phase < 0) {
      device->buttons = 1;
      return;
    }
    if (row.cycle == 200) device->buttons = 0;
    if (row.cycle == 999) device->buttons = 2;
    if (row.cycle == 1099) device->buttons = 3;  // another one, the first still down
    if (row.cycle == 1499) *keys += 1;
  };
  const SessionRun run = run_session_on(session, device, limits_of("virtual"), {}, options);
  REQUIRE(run.outcome.cause == StopCause::finished);
  const HilRecording recording = read_recording(folder / "r");
  CHECK(marked_in(recording) == std::vector<std::uint64_t>{1000, 1100, 1500});
  const Json expected = {{{"cycle", 1000}, {"by", "button"}},
                         {{"cycle", 1100}, {"by", "button"}},
                         {{"cycle", 1500}, {"by", "key"}}};
  CHECK(recording.closing.at("markers") == expected);
}

TEST_CASE("A simulated hand waits for its session also if its device is prepared after the loop") {
  HilSession session = test::parsed(test::short_session());
  session.servo.gate->rest_time_s = 3.0;  // by then its script would have pressed
  const LoopModel loop = make_loop_model(session);
  VirtualOmega7 device(session.plant, session.operator_script());
  ServoStep step(
      device, *loop.model,
      loop_settings(session, loop, check_rendering(session, *loop.model, loop, "virtual"), true));
  device.prepare(session.preparation);  // as run_in_real_time() does
  device.enable_forces();
  ServoRecord row;
  double first_m = 0.0;
  int waited = 0;
  for (; waited < 5000; ++waited) {
    REQUIRE(step.cycle(0, row) == StopCause::none);
    if (row.phase >= 0) break;
    if (waited == 0) first_m = row.tool_depth_m;
    device.advance(session.servo.period_s);
  }
  CHECK(waited < 4000);
  CHECK(row.tool_depth_m == Approx(first_m).margin(1e-4));
}

TEST_CASE("Enter in a terminal begins a session that waits for it, and then sets markers") {
  HilSession session = test::parsed(
      test::with(test::short_session(), "/start", {{"confirm", true}, {"limit", "30 s"}}));
  int keyboard = -1, terminal = -1;
  REQUIRE(::openpty(&keyboard, &terminal, nullptr, nullptr, nullptr) == 0);
  const auto press = [&] {
    (void)!::write(keyboard, "\n", 1);
    pollfd there{terminal, POLLIN, 0};  // the kernel passes a line on when it likes
    (void)::poll(&there, 1, 60'000);
  };
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  const std::function<void()> look = watch_enter(terminal, session, options);
  options.interrupted = [&] {
    look();
    return false;
  };
  // In virtual time keys are looked at every 1024 cycles.
  int waited = 0;
  options.watcher = [&](const ServoRecord& row) {
    if (row.phase < 0 && ++waited == 1500) press();
    if (row.phase >= 0 && (row.cycle == 1000 || row.cycle == 3000)) press();
  };
  const SessionRun run = run_session_on(session, std::make_shared<Pressed>(session),
                                        limits_of("virtual"), {}, options);
  ::close(keyboard);
  ::close(terminal);
  REQUIRE(run.outcome.cause == StopCause::finished);
  CHECK(waited > 1500);  // it did not begin by itself
  CHECK(waited <= 1500 + 1024);
  const HilRecording recording = read_recording(folder / "r");
  const std::vector<std::uint64_t> marked = marked_in(recording);
  REQUIRE(marked.size() == 2);
  CHECK((marked[0] > 1000 && marked[0] <= 1000 + 1024));
  CHECK((marked[1] > 3000 && marked[1] <= 3000 + 1024));
  const Json expected = {{{"cycle", marked[0]}, {"by", "key"}},
                         {{"cycle", marked[1]}, {"by", "key"}}};
  CHECK(recording.closing.at("markers") == expected);
}

TEST_CASE("A session in real time says when it was, by both clocks; one in virtual time does not") {
  const HilSession session = test::parsed(test::short_session());
  const LoopModel model = make_loop_model(session);
  const auto header = [&](bool real_time) {
    return recording_header(session, DeviceIdentity{}, model, real_time, {}, Json());
  };
  CHECK(header(false).at("clock").is_null());
  const Json first = header(true).at("clock"), second = header(true).at("clock");
  CHECK(first.at("opened_monotonic_ns").get<std::int64_t>() > 0);
  CHECK(second.at("opened_monotonic_ns").get<std::int64_t>() >=
        first.at("opened_monotonic_ns").get<std::int64_t>());
  CHECK_THAT(first.at("opened_utc").get<std::string>(), Catch::Matches("20..-..-..T.*Z"));

  ServoOutcome outcome;
  CHECK_FALSE(recording_closing(outcome).contains("clock"));
  outcome.real_time = true;
  outcome.first_cycle_monotonic_ns = first.at("opened_monotonic_ns").get<std::int64_t>();
  const Json clock = recording_closing(outcome).at("clock");
  CHECK(clock.at("first_cycle_monotonic_ns") == first.at("opened_monotonic_ns"));
  CHECK_THAT(clock.at("first_cycle_utc").get<std::string>(), Catch::Matches("20..-..-..T.*Z"));
}

TEST_CASE("A session whose largest force no hand feels says so, in text and in JSON") {
  const HilSession session = test::parsed(test::short_session());
  SessionRun run;
  run.model = make_loop_model(session);
  run.largest_force_N = 0.76e-3;
  CHECK_THAT(run_text(session, run), Contains("largest force 760 uN: no hand feels it"));
  CHECK(run_json(session, run).dump().find("\"perceptible\":false") != std::string::npos);
  run.largest_force_N = 0.098;
  CHECK_THAT(run_text(session, run), Contains("largest force 98 mN\n"));
  CHECK(run_json(session, run).dump().find("\"perceptible\":true") != std::string::npos);
}

/// A check of 60 s at 1 kHz: nearly all wake-ups 20 us late, some and a few later.
JitterCheck check_with(int some, std::int64_t some_ns, int few, std::int64_t few_ns) {
  JitterCheck check = test::made_check();
  check.duration_s = 60.0;
  test::add_cycles(check, 60'000 - some - few, 19'500);
  test::add_cycles(check, some, some_ns);
  test::add_cycles(check, few, few_ns);
  assess(check);
  return check;
}

TEST_CASE("A check tells p99.99 beside the watchdog, the bound 3/T, and names what it foretells") {
  // p99.9 is 100 us and p99.99 300 us; 1e-4 of the cycles of an hour are 360:
  // 300 + 200 / ln 10 * ln 360 = 811 us.
  const JitterCheck check = check_with(100, 99'500, 10, 299'500);
  const std::string text = check_text(check);
  CHECK_THAT(text, Contains("p99.99 of the wake-ups 300 us, the watchdog waits for 8000 us"));
  CHECK_THAT(text, Contains("stalls beyond it: 0: fewer than 180 an hour with 95 % (3/T of 60 s)"));
  CHECK_THAT(text, Contains("extrapolated, not measured: 811 us once an hour"));
  const std::string json = check_json(check).dump();
  CHECK_THAT(json, Contains("\"upper_95_per_s\":0.05"));
  CHECK_THAT(json, Contains("\"once_an_hour_extrapolated_s\":0.000811"));
  CHECK_THAT(json, Contains("\"extrapolation\":\"811 us once an hour, if the tail"));
  // Two stalls in 60 s: with 95 % fewer than 6.296 in that time (half of chi-squared, 6 degrees).
  const JitterCheck stalled = check_with(100, 99'500, 2, 9'000'000);
  CHECK_THAT(check_text(stalled),
             Contains("stalls beyond it: 2: fewer than 378 an hour with 95 % (Poisson, in 60 s)"));
  CHECK_THAT(check_json(stalled).dump(), Contains("\"upper_95_per_s\":0.10493"));
}

TEST_CASE("An extrapolation is never below what was seen, and keeps no rate beyond the watchdog") {
  // Five stalls of 3 ms: p99.9 and p99.99 are 20 us, and so would be what falls beyond them.
  const JitterCheck seen = check_with(0, 0, 5, 3'000'000);
  REQUIRE(once_an_hour_s(seen));
  CHECK(*once_an_hour_s(seen) == Approx(0.003));
  CHECK_THAT(check_text(seen), Contains("extrapolated, not measured: 3000 us once an hour, the "
                                        "largest seen"));
  CHECK(seen.timing_kept);
  CHECK_THAT(seen.timing,
             Contains("kept 1000 Hz for 60 s") && Contains("fewer than 180 an hour with 95 % (3/T "
                                                           "of 60 s)"));
  // p99.9 is 100 us and p99.99 2.5 ms: 2.5 + 2.4 / ln 10 * ln 360 = 8.64 ms.
  const JitterCheck beyond = check_with(100, 99'500, 10, 2'499'500);
  CHECK(*once_an_hour_s(beyond) == Approx(0.00864).epsilon(1e-2));
  CHECK_FALSE(beyond.timing_kept);
  CHECK_THAT(beyond.timing, Contains("extrapolated, not measured"));
  CHECK(check_json(beyond).at("timing_kept") == false);
}

TEST_CASE("A stall counts with the period before it: so long the device has no command") {
  // 7.5 ms late at 1 kHz are 8.5 ms without a command.
  const JitterCheck check = check_with(0, 0, 1, 7'500'000);
  CHECK(stalls_beyond_watchdog(check) == 1);
  CHECK_FALSE(check.timing_kept);
  CHECK_THAT(check.timing, Contains("a stall of 7.5 ms leaves 8.5 ms without a command"));
  CHECK(stalls_beyond_watchdog(check_with(0, 0, 1, 6'900'000)) == 0);
}

TEST_CASE("A check that is too short to extrapolate says so, in text and in JSON") {
  JitterCheck check;
  check.rate_Hz = 1000.0;
  check.duration_s = 5.0;
  check.watchdog_s = 0.008;
  check.outcome.cycles = 5000;
  for (int i = 0; i < 5000; ++i) check.outcome.woke_late.note(19'500);
  CHECK_THAT(check_text(check),
             Contains("extrapolated, not measured: too short: 5000 cycles, 20,000 needed\n"));
  const Json stalls = check_json(check).at("stalls");
  CHECK(stalls.at("extrapolation") == "too short: 5000 cycles, 20,000 needed");
  CHECK(stalls.at("once_an_hour_extrapolated_s").is_null());
}

}  // namespace
}  // namespace tpm::haptics
