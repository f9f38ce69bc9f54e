// A loop of one's own at another rate than its contact: its forces are those of the right one, or
// it is told.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>

#include "hil_scenes.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/loop_contact.hpp"

namespace tpm::haptics {
namespace {

/// A contact of the paper's star for a loop of 1 kHz that moves nothing.
class RatedContact {
 public:
  explicit RatedContact(bool start_gate = false, const Json& json = test::short_session()) {
    write_file(folder_ / "session.json", to_text(json));
    LoopContactOptions options;
    options.device = "virtual";
    options.start_gate = start_gate;
    contact_.emplace(folder_ / "session.json", options);
  }
  LoopContact* operator->() { return &*contact_; }

 private:
  test::TempFolder folder_;
  std::optional<LoopContact> contact_;
};

/// In the air for a second, then down at 1 mm/s: 2 mm deep after 5 s.
Eigen::Vector3d tool_at(double time_s) {
  return {0.0, 0.0, 2e-3 - 1e-3 * std::max(0.0, time_s - 1.0)};
}

struct RatedLoop {
  double rate_Hz = 1000.0, jitter = 0.0;  ///< in parts of a call
  double begins_s = 0.0, lasts_s = 5.0;
};

struct RatedEnd {
  StopCause cause = StopCause::none;
  int calls = 0;
  double force_N = 0.0, time_s = 0.0;
};

RatedEnd end_of(RatedContact& contact, const RatedLoop& loop) {
  RatedEnd end;
  const int calls = static_cast<int>(std::lround(loop.lasts_s * loop.rate_Hz));
  for (int i = 0; i <= calls && end.cause == StopCause::none; ++i) {
    const double time_s = i / loop.rate_Hz;
    const double told_s = loop.begins_s + time_s + loop.jitter * std::sin(1.7 * i) / loop.rate_Hz;
    Eigen::Vector3d force_N;
    end.cause = contact->step_at(told_s, tool_at(time_s), force_N);
    end.force_N = force_N.z();
    ++end.calls;
  }
  end.time_s = contact->state().time_s;
  return end;
}

/// By periods, without a clock.
double right_force_N() {
  RatedContact contact;
  Eigen::Vector3d force_N;
  for (int i = 0; i <= 5000; ++i)
    CHECK(contact->step(tool_at(1e-3 * i), force_N) == StopCause::none);
  return force_N.z();
}

TEST_CASE("A loop at any rate has the forces of the right one, or is told that it is late") {
  const double right_N = right_force_N();
  REQUIRE(right_N > 0.2);
  for (const double rate_Hz : {100.0, 250.0, 500.0, 900.0, 970.0, 1000.0, 1030.0, 2000.0, 4000.0}) {
    for (const double jitter : {0.0, 0.2}) {
      for (const bool start_gate : {false, true}) {
        CAPTURE(rate_Hz, jitter, start_gate);
        RatedContact contact(start_gate);
        const RatedEnd end = end_of(contact, {.rate_Hz = rate_Hz, .jitter = jitter});
        if (end.cause != StopCause::none) {
          CHECK(end.cause == StopCause::overrun_storm);
          CHECK(contact->state().row.stop == StopCause::overrun_storm);
          CHECK(end.force_N == 0.0);
          CHECK(rate_Hz < 950.0);
          // A hundred late ones, after those that the gate waits for.
          if (rate_Hz <= 500.0) CHECK(end.calls < (start_gate ? 200 : 150));
          continue;
        }
        CHECK(rate_Hz > 500.0);
        CHECK(end.force_N == Approx(right_N).epsilon(5e-3));
        if (!start_gate) CHECK(end.time_s == Approx(5.001).margin(2e-3));
      }
    }
  }
}

TEST_CASE("A loop that is too slow is told so while its contact still waits to begin") {
  RatedContact contact(true);
  Eigen::Vector3d force_N;
  StopCause cause = StopCause::none;
  int calls = 0;
  while (cause == StopCause::none && calls < 150) {  // of a tool that never rests
    cause = contact->step_at(1e-2 * calls, {0.0, 0.0, 2e-2 + 1e-3 * (calls % 2)}, force_N);
    CHECK(contact->state().row.phase == -1);
    ++calls;
  }
  CHECK(cause == StopCause::overrun_storm);
  // A loop that stalls while it waits is none.
  RatedContact stalled(true);
  for (int i = 0; i < 120; ++i) {
    CHECK(stalled->step(tool_at(0.0), force_N, i % 20 == 0 ? 300 : 0) == StopCause::none);
  }
}

TEST_CASE("A tool at rest is waited for by the time that passes, not by the calls") {
  const Json patient = test::with(test::short_session(), "/limits", Json{{"late_cycles", 1000}});
  RatedContact contact(true, patient);
  Eigen::Vector3d force_N;
  int calls = 0;
  do {
    REQUIRE(contact->step(tool_at(0.0), force_N, 3) == StopCause::none);
    ++calls;
  } while (contact->state().row.phase < 0 && calls < 300);
  CHECK(calls == 65);  // 0.25 s after the first call, and the call that begins
  // Nobody saw what the tool did in a gap of 0.3 s.
  RatedContact gap(true);
  for (const int missed : {0, 299, 0, 0}) {
    CHECK(gap->step(tool_at(0.0), force_N, missed) == StopCause::none);
    CHECK(gap->state().row.phase == -1);
  }
}

TEST_CASE("A loop of the right mean rate is not late, however much its intervals vary") {
  const auto held = [](double varies, unsigned seed) {
    RatedContact contact;
    std::mt19937 random(seed);
    double time_s = 0.0;
    RatedEnd end;
    while (time_s < 20.0 && end.cause == StopCause::none) {
      const double share = 2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0;
      time_s += 1e-3 * (1.0 + varies * share);
      Eigen::Vector3d force_N;
      end.cause = contact->step_at(time_s, tool_at(std::min(time_s, 5.0)), force_N);
      end.force_N = force_N.z();
    }
    end.time_s = contact->state().time_s;
    return end;
  };
  const double right_N = held(0.0, 1).force_N;
  REQUIRE(right_N > 0.1);
  for (const double varies : {0.3, 0.5, 0.8}) {
    for (const unsigned seed : {1U, 2U, 3U}) {
      CAPTURE(varies, seed);
      const RatedEnd end = held(varies, seed);
      CHECK(end.cause == StopCause::none);
      CHECK(end.force_N == Approx(right_N).epsilon(1e-3));
      CHECK(end.time_s == Approx(20.0).margin(6e-3));
    }
  }
}

TEST_CASE(
    "A session that allows every call to be late is right, or told that the tissue is behind") {
  const Json patient = test::with(test::short_session(), "/limits", Json{{"late_cycles", 1000}});
  RatedContact every_fourth(false, patient);
  const RatedEnd end = end_of(every_fourth, {.rate_Hz = 250.0});
  CHECK(end.cause == StopCause::none);
  CHECK(end.force_N == Approx(right_force_N()).epsilon(1e-2));
  // Ten periods a call, of which the tissue can live through eight.
  RatedContact every_tenth(false, patient);
  CHECK(end_of(every_tenth, {.rate_Hz = 100.0, .lasts_s = 8.0}).cause == StopCause::overrun_storm);
}

TEST_CASE("Where a clock begins does not matter, and one that cannot tell a period is refused") {
  const double right_N = right_force_N();
  for (const double begins_s : {-7e9, 1e6, 1.8e9, 7e9}) {
    CAPTURE(begins_s);
    RatedContact contact;
    const RatedEnd end = end_of(contact, {.begins_s = begins_s});
    CHECK(end.cause == StopCause::none);
    CHECK(end.force_N == Approx(right_N).epsilon(1e-3));
  }
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  RatedContact contact;
  for (const double time_s : {1e13, 1e15, -1e15, 1.8e18, kInfinite, -kInfinite,
                              std::numeric_limits<double>::quiet_NaN()}) {
    CAPTURE(time_s);
    Eigen::Vector3d force_N(7.0, 7.0, 7.0);
    CHECK(contact->step_at(time_s, tool_at(0.0), force_N) == LoopContact::kBadTime);
    CHECK(force_N == Eigen::Vector3d::Zero());
  }
  // None of them was a call.
  Eigen::Vector3d force_N;
  CHECK(contact->step_at(5.0, tool_at(0.0), force_N) == StopCause::none);
  CHECK(contact->step_at(4.999, tool_at(0.0), force_N) == LoopContact::kBadTime);
  CHECK(contact->step_at(5.001, tool_at(0.0), force_N) == StopCause::none);
  CHECK(contact->state().missed == 0);
}

TEST_CASE("A force is not kept for a clock that stands still") {
  RatedContact contact;
  const RatedEnd pushed = end_of(contact, {.lasts_s = 4.0});
  REQUIRE(pushed.force_N > 0.1);
  Eigen::Vector3d force_N;
  for (int i = 0; i < LoopContact::kMostStill; ++i) {
    REQUIRE(contact->step_at(4.0, tool_at(4.0), force_N) == StopCause::none);
    REQUIRE(force_N.z() == pushed.force_N);
  }
  for (int i = 0; i < 3; ++i) {
    CHECK(contact->step_at(4.0, tool_at(4.0), force_N) == LoopContact::kBadTime);
    CHECK(force_N == Eigen::Vector3d::Zero());
  }
  CHECK(contact->step_at(4.001, tool_at(4.0), force_N) == StopCause::none);
  CHECK(force_N.z() > 0.1);
}

}  // namespace
}  // namespace tpm::haptics
