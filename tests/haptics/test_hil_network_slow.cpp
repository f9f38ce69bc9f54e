// Sessions with a whole network in the loop, or beside it.
#include <catch2/catch.hpp>

#include "counted_allocations.hpp"
#include "endless_motion.hpp"
#include "expected_values.hpp"
#include "hil_scenes.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/virtual_omega7.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpm/haptics/session/surface_scene.hpp"
#include "tpm/haptics/show/hil_report.hpp"
#include "tpm/haptics/verify/verify.hpp"
#include "tpm/show/draw.hpp"
#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

struct Ran {
  HilRecording recording;
  std::string bytes;
  TissueShape shape;
};

Ran ran(const Json& session) {
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  const SessionRun run = run_session(test::parsed(session), {}, options);
  REQUIRE(run.outcome.cause == StopCause::finished);
  return {read_recording(folder / "r"), read_file(folder / "r"), run.model.shape};
}

Ran ran(const char* kind) {
  return ran(test::network_session(kind));
}

TEST_CASE("A session of the whole network verifies", "[heavy]") {
  VerifyOptions options;
  options.motion_tolerance_m = 2e-6;
  const Verification in_loop = verify(ran("network").recording, options);
  CHECK(in_loop.all.peak_N > 0.1);
  CHECK(in_loop.all.max_N < test::allowed_error("session.network_in_loop") * in_loop.all.peak_N);
  REQUIRE(in_loop.others.size() == 1);  // CVODE, over the whole of it
  CHECK(in_loop.others[0].end_s > 2.5);
  CHECK(in_loop.others[0].apart_N <
        test::allowed_error("session.network_references_apart") * in_loop.all.peak_N);
  CHECK(ran("network").bytes == ran("network").bytes);
}

TEST_CASE("No model of the loop takes from the heap or gives back while it is stepped") {
  const Json session =
      GENERATE_COPY(test::network_session("network"), test::network_session("condensed"),
                    test::network_session("planned"),
                    test::with(test::network_session("planned"), "/model/tolerance", "0.2%"),
                    test::short_session(), test::slide_session());
  CAPTURE(session.at("model").dump());
  HilSession parsed = test::parsed(session);
  follow_surface(parsed);
  const LoopModel model = make_loop_model(parsed);
  VirtualOmega7 device(parsed.plant, parsed.operator_script());
  device.prepare(parsed.preparation);
  device.enable_forces();
  ServoSettings settings{parsed.servo};
  settings.model_push = model.push;
  settings.to_model = model.to_model;
  ServoStep step(device, *model.model, settings);
  ServoRecord row;
  double most_N = 0.0;
  StopCause cause = StopCause::none;
  const testing::HeapWatch heap;
  while (cause == StopCause::none) {
    cause = step.cycle(0, row);
    device.advance(settings.period_s);
    most_N = std::max(most_N, Eigen::Map<const Eigen::Vector3d>(row.commanded_N).norm());
  }
  const long calls = heap.calls();
  CHECK(calls == 0);
  CHECK(cause == StopCause::finished);
  CHECK(most_N > 0.05);
}

/// One session with each tolerance: what was picked, and how far it was from the reference.
struct Picked {
  Json plan;
  double error = 0.0;  ///< largest, in parts of the peak
  std::shared_ptr<ContactModel> drawn;
};

Picked picked(const char* tolerance) {
  const Json json = test::with(test::network_session("planned"), "/model/tolerance", tolerance);
  const Ran run = ran(json);
  VerifyOptions options;
  options.motion_tolerance_m = 2e-6;
  options.window_s = 0.0;
  const Verification v = verify(run.recording, options);
  return {run.recording.header.at("model").at("plan"), v.all.max_N / v.all.peak_N, run.shape.field};
}

TEST_CASE("A planned model keeps to the tolerance, and a tighter one picks another") {
  const Picked wide = picked("10%");
  const Picked tight = picked("0.2%");
  CAPTURE(wide.plan.dump(), tight.plan.dump());
  CHECK(wide.plan.at("choice") != tight.plan.at("choice"));
  CHECK(wide.error < 0.1);
  // What letting go within a period costs is none of the model's.
  CHECK(tight.error < test::allowed_error("session.planned_for_0.2_percent"));
  CHECK(tight.error < wide.error);
  // The picture has the same model, in steps of its own.
  REQUIRE(tight.drawn);
  CHECK(tight.drawn->period_s() == kDrawnEvery_s);
  CHECK(tight.drawn->spheres() == 60);
}

TEST_CASE("A session without a kind is planned for 1 %, of the star it is the element") {
  Json json = test::short_session();
  json.at("model").erase("kind");
  std::size_t told = 0;
  const LoopModel loop =
      make_loop_model(test::parsed(json), [&told](const std::string&) { ++told; });
  CHECK(told == kPlanningSteps);
  CHECK(loop.plan.at("choice") == "element");
  CHECK(loop.plan.at("tolerance") == 0.01);
  Json known = json;
  known["model"]["kind"] = "element";
  const LoopModel element = make_loop_model(test::parsed(known));
  for (int i = 1; i <= 2000; ++i) {
    const double depth = 2e-6 * i;
    const Eigen::Vector3d there = depth * loop.push;
    const double force = -loop.push.dot(loop.model->step(there).force_N);
    const double exact = -element.push.dot(element.model->step(depth * element.push).force_N);
    CHECK(std::abs(force - exact) <= 1e-9 * (1.0 + exact));
  }
}

TEST_CASE("A tolerance that nothing keeps within a period is refused, with what would do") {
  const Json json = test::with(test::network_session("planned"), "/model/tolerance", "0.000001");
  CHECK_THROWS_WITH(make_loop_model(test::parsed(json)),
                    Contains("nothing that the loop steps is within 0.0001 %"));
}

/// One motion for `rounds` times 2 s of a tissue that relaxes within 0.1 s, and what has grown.
struct Endless {
  test::Drift drift;
  double grown_bytes = 0.0;
};

Endless endless(const Json& json, std::uint64_t rounds) {
  HilSession session = test::parsed(json);
  const LoopModel loop = make_loop_model(session);
  ServoSettings servo{session.servo};
  servo.model_push = loop.push;
  // The contact's longest relaxation time is twice the bonds': 40 of it.
  constexpr std::uint64_t kRound = 2000, kSettled = 5, kRest = 8000;
  test::EndlessMotion device(kRound, 4e-3);
  double settled_bytes = 0.0, most_bytes = 0.0;
  Endless run;
  run.drift = test::endless_run(
      device, *loop.model, servo, kRound, rounds, kSettled, kRest, [](const ServoRecord&) {},
      [&](std::uint64_t done) {
        if (done == kSettled) settled_bytes = test::resident_bytes();
        if (done > kSettled) most_bytes = std::max(most_bytes, test::resident_bytes());
      });
  run.grown_bytes = most_bytes - settled_bytes;
  return run;
}

// tests/measure/hil_long.cpp does this for ten hours.
TEST_CASE("Twenty minutes of one motion: nothing grows, and the end feels like the start") {
  const Endless run = endless(test::network_session("condensed", "2.4e3 Pa s"), 600);
  CHECK(run.drift.peak_N > 0.05);
  CHECK(run.drift.late_rounds_N == 0.0);
  // Its guard keeps a viscous state whose energy can no longer be told from rest
  // (docs/theory.md).
  CHECK(run.drift.end_start_N <
        test::allowed_error("session.drift_in_twenty_minutes") * run.drift.peak_N);
  CHECK(run.grown_bytes < test::allowed_cost("session.memory_growth_in_twenty_minutes"));
}

TEST_CASE("The loop itself forgets to the last digits") {
  const Json json = test::with(test::short_session(), "/model/scene/material/eta1", "2.4e3 Pa s");
  const Endless run = endless(json, 10);
  CHECK(run.drift.late_rounds_N == 0.0);
  CHECK(run.drift.end_start_N < 1e-14 * run.drift.peak_N);
}

TEST_CASE("The report of a session says how it ended and where it left the range of the model") {
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  const SessionRun run = run_session(test::parsed(test::short_session()), {}, options);
  CHECK(run.outcome.counts.beyond_model == 0);
  HilRecording recording = read_recording(folder / "r");
  const Verification v = verify(recording);
  write_hil_report(recording, v, folder / "trusted", find_drawing_python());
  const std::string trusted = read_file(folder / "trusted/report.md");
  CHECK_THAT(trusted, Contains("end: finished") && Contains("SIMULATED DEVICE") &&
                          Contains("within the range that the model is good for in every cycle"));
  CHECK(std::filesystem::exists(folder / "trusted/report.html"));
  for (const std::size_t row : {500, 700}) recording.rows.at(row).flags |= kBeyondModel;
  CHECK(summary_of(recording).counts.beyond_model == 2);
  CHECK(summary_of(recording).first_beyond_s == 0.5);
  write_hil_report(recording, v, folder / "not", find_drawing_python());
  CHECK_THAT(read_file(folder / "not/report.md"),
             Contains("beyond the range that the model is good for in 2 cycles, first at 0.5 s"));
}

}  // namespace
}  // namespace tpm::haptics
