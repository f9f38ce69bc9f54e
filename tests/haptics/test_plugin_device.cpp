// Devices of one's own as plugins: the example, and plugins that are wrong in one way each.
#include <catch2/catch.hpp>
#include <cstdlib>

#include "counted_allocations.hpp"
#include "hil_scenes.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/device/plugin_device.hpp"
#include "tpm/haptics/loop/servo_step.hpp"
#include "tpm/haptics/session/identify_run.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/session_run.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

DeviceChoice plugin_choice(const char* file = TPM_TEST_DEVICE_PLUGIN) {
  DeviceChoice choice;
  choice.kind = "plugin";
  choice.plugin = file;
  return choice;
}

/// A wrong plugin, in the way that $TPM_BAD_PLUGIN says.
std::string refusal_of_bad(const char* way) {
  (void)setenv("TPM_BAD_PLUGIN", way, 1);
  const std::string words =
      test::refusal_of([] { (void)PluginDevice(TPM_TEST_BAD_DEVICE_PLUGIN); });
  (void)unsetenv("TPM_BAD_PLUGIN");
  CHECK(words.find('\n') == std::string::npos);
  return words;
}

TEST_CASE("A device of a plugin goes through a session") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  const SessionRun run = run_session(session, plugin_choice(), options);
  CHECK(run.outcome.cause == StopCause::finished);
  CHECK(run.device.kind == "plugin");
  CHECK_FALSE(run.device.hardware);
  const HilRecording recording = read_recording(folder / "r");
  CHECK(recording.simulated());
  CHECK_THAT(device_line(recording), Contains("SIMULATED DEVICE"));
  // The hand is a spring of 400 N/m whose other end goes down at 2 mm/s: where it is, the force
  // says.
  double most_N = 0.0, worst_m = 0.0, from_m = 0.0;
  for (std::size_t i = 1; i < recording.rows.size(); ++i) {
    const ServoRecord& row = recording.rows[i];
    if (row.stop != StopCause::none) break;
    const double end_m = row.position_m[2] - recording.rows[i - 1].commanded_N[2] / 400.0;
    const bool moving = i > 1 && from_m < 1.999e-3 && end_m > -5.999e-3;
    if (moving) worst_m = std::max(worst_m, std::abs(from_m - end_m - 2e-6));
    from_m = end_m;
    most_N = std::max(most_N, row.commanded_N[2]);
  }
  CHECK(most_N > 0.4);
  CHECK(run.rendering.friction_N_s_per_m == 0.1);  // what the plugin says, not a simulated Omega.7
  CHECK(worst_m < 1e-12);
}

TEST_CASE("A step with a device of a plugin takes nothing from the heap") {
  const HilSession session = test::parsed(test::short_session());
  const LoopModel loop = make_loop_model(session);
  PluginDevice device(TPM_TEST_DEVICE_PLUGIN);
  (void)device.open();
  device.prepare(session.preparation);
  device.enable_forces();
  ServoSettings settings{session.servo};
  settings.gate.reset();
  settings.model_push = loop.push;
  ServoStep step(device, *loop.model, settings);
  ServoRecord row;
  StopCause cause = StopCause::none;
  const testing::HeapWatch heap;
  for (int i = 0; i < 2500 && cause == StopCause::none; ++i) cause = step.cycle(0, row);
  const long calls = heap.calls();
  CHECK(cause == StopCause::none);
  CHECK(row.commanded_N[2] > 0.01);
  CHECK(calls == 0);
}

TEST_CASE("A session that asks for more than a plugin's device can take is refused") {
  Json json = test::short_session();
  json["limits"]["force"] = "12 N";  // the device says 10 N
  const test::TempFolder folder;
  SessionRunOptions options;
  options.recording = folder / "r";
  CHECK_THAT(
      test::refusal_of([&] { (void)run_session(test::parsed(json), plugin_choice(), options); }),
      Contains("device 'plugin': the session's limits/force is 12 N; expected at most 10 N"));
  CHECK_FALSE(std::filesystem::exists(folder / "r"));
  json = test::short_session();
  json["mounting"]["effector_mass_kg"] = 0.1;
  CHECK_THAT(
      test::refusal_of([&] { (void)run_session(test::parsed(json), plugin_choice(), options); }),
      Contains("is not told how its device is mounted"));
}

TEST_CASE("The file of an identified plugin has its limits: a loop in C needs no plugin") {
  IdentifyRun run;
  run.device.kind = "plugin";
  run.device.hardware = true;
  run.period_s = 1e-3;
  run.limits = limits_of(plugin_choice());
  const DeviceFile file = parse_device_file(device_file_json(run, ""), "d");
  const DeviceLimits limits = limits_from(file);
  CHECK(limits.hardware());
  CHECK(limits.force_N == run.limits.force_N);
  CHECK(limits.stiffness_N_per_m == run.limits.stiffness_N_per_m);
  CHECK(limits.known_by("reach_m") == "stated by the plugin");
  // Beside the plugin the same file is taken, too.
  CHECK(limits_by_file(run.limits, file).slew_N_per_s == run.limits.slew_N_per_s);
}

TEST_CASE("A plugin whose device has motors is not driven in virtual time") {
  (void)setenv("TPM_BAD_PLUGIN", "hardware", 1);
  PluginDevice device(TPM_TEST_BAD_DEVICE_PLUGIN);
  CHECK_THAT(test::refusal_of([&] { device.prepare({}); }),
             Contains("a device with motors keeps the clock; expected --clock real"));
  (void)unsetenv("TPM_BAD_PLUGIN");
}

TEST_CASE("What is wrong with a plugin is told in one line") {
  CHECK_THAT(test::refusal_of([] { (void)PluginDevice("none.so"); }),
             Contains("./none.so: cannot be loaded"));
  CHECK_THAT(test::refusal_of([] { (void)PluginDevice(TPM_TEST_HAPTICS); }),
             Contains("has no tpm_device_plugin_get"));
  CHECK_THAT(test::refusal_of([] { (void)limits_of(plugin_choice("")); }),
             Contains("--device plugin: no plugin is named; expected --plugin FILE"));
  CHECK_THAT(refusal_of_bad("nothing"), Contains("answers nothing"));
  CHECK_THAT(refusal_of_bad("version"), Contains("version 2"));
  CHECK_THAT(refusal_of_bad("size"), Contains("bytes"));
  CHECK_THAT(refusal_of_bad("missing"), Contains("has no read, cut_forces"));
  CHECK_THAT(refusal_of_bad("count"), Contains("cannot look for devices: the bus is?down"));
  CHECK_THAT(refusal_of_bad("none"), Contains("sees no device"));
  CHECK_THAT(refusal_of_bad("describe"), Contains("gives no reason"));
  CHECK_THAT(refusal_of_bad("force"), Contains("says force_N is nan"));
  CHECK_THAT(refusal_of_bad("ramp"), Contains("says least_ramp_in_s is 0; expected at least 0.1"));
  CHECK_THAT(refusal_of_bad("friction"),
             Contains("says friction_N_s_per_m is 10.1; expected at least 0 and at most 10"));
  CHECK_THAT(refusal_of_bad("two"), Contains("2 devices fit"));
}

}  // namespace
}  // namespace tpm::haptics
