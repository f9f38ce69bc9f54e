// The vendor's library, stood in for by one with the same C interface and loaded in the same way.
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "hil_scenes.hpp"
#include "operator_lines.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/hdf5/hdf5.hpp"
#include "tpm/haptics/device/force_dimension.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/recording_export.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "vendor_script.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;

DeviceChoice stand_in() {
  DeviceChoice choice;
  choice.kind = "omega7";
  choice.library = TPM_STAND_IN_DHD;
  choice.file = TPM_TEST_SOURCE_DIR "/tests/fixtures/stand_in_device.json";
  return choice;
}

struct Ran {
  SessionRun run;
  HilRecording recording;
};

Ran ran(const HilSession& session, const DeviceChoice& device, const std::string& file) {
  SessionRunOptions options;
  options.recording = file;
  SessionRun run = run_session(session, device, options);
  return {std::move(run), read_recording(file)};
}

/// Cycles before the session begins, in which the tool is at rest.
constexpr std::uint64_t kWaitedCycles = 250;

std::string operator_lines(const HilSession& session, const test::TempFolder& folder) {
  write_file(folder / "operator", to_lines(session.operator_script()));
  // In virtual time cycles come as fast as the machine goes, and may come late.
  return "watchdog_by_clock 0\noperator " + (folder / "operator") + "\nwait " +
         std::to_string(kWaitedCycles) + "\n";
}

TEST_CASE("A missing library is told with all that was tried") {
  (void)setenv("FDSDK", "/no/sdk", 1);
  const std::string message = test::vendor_message_of([] { ForceDimension device(""); });
  (void)unsetenv("FDSDK");
  CHECK_THAT(message, Contains("/no/sdk/lib/release/lin-x86_64-gcc/libdrd.so.3"));
  CHECK_THAT(message, Contains("libdhd.so.3") && Contains("--dhd-library"));
  CHECK_THAT(test::vendor_message_of([] { ForceDimension device("/no/such.so"); }),
             Contains("/no/such.so"));
}

TEST_CASE("A library without a symbol, or of another version, is refused by name") {
  const test::VendorScript script("");
  CHECK_THAT(
      test::vendor_message_of([] { ForceDimension device(TPM_STAND_IN_DHD_WITHOUT_A_SYMBOL); }),
      Contains("has no drdStop;"));
  const test::VendorScript old("version 2\n");
  CHECK_THAT(test::vendor_message_of([] { ForceDimension device(TPM_STAND_IN_DHD); }),
             Contains("is version 2.14.0.0"));
}

TEST_CASE("The device says what it is; a link behind which a simulator may be is no hardware") {
  const auto identity = [](const std::string& lines) {
    const test::VendorScript script(lines);
    ForceDimension device(TPM_STAND_IN_DHD);
    return device.open();
  };
  const DeviceIdentity real = identity("com_mode 0\n");
  CHECK(real.hardware);
  CHECK(real.serial == "4711");
  CHECK(real.firmware == "2.50");
  CHECK(real.library_version == "3.14.0.0");
  CHECK(identity("com_mode 1\n").hardware);
  CHECK(identity("com_mode 2\n").hardware);  // a mode that is not known
  for (const char* mode : {"com_mode 3\n", "com_mode 4\n"}) {
    CHECK_FALSE(identity(mode).hardware);
  }
  CHECK(to_string(identity("com_mode 3\n").link) == "simulated");
  CHECK(to_string(identity("com_mode 4\n").link) == "network");
  CHECK(identity("type 37\n").left_handed);
}

TEST_CASE("A device that is not initialised does not move unasked") {
  const test::VendorScript script("initialised 0\n");
  DevicePreparation preparation;
  {
    ForceDimension device(TPM_STAND_IN_DHD);
    (void)device.open();
    CHECK_THAT(test::vendor_message_of([&] { device.prepare(preparation); }),
               Contains("--may-move"));
  }
  CHECK_FALSE(script.happened("moved"));
  preparation.may_move = true;
  ForceDimension device(TPM_STAND_IN_DHD);
  (void)device.open();
  device.prepare(preparation);
  CHECK(script.happened("moved"));
}

TEST_CASE("An initialisation that moves the device ends when it is interrupted, motors off") {
  const test::VendorScript script("initialised 0\ninit_ms 60000\n");
  const auto start = std::chrono::steady_clock::now();
  DevicePreparation preparation;
  preparation.may_move = true;
  preparation.interrupted = [&] { return script.happened("moved"); };
  ForceDimension device(TPM_STAND_IN_DHD);
  (void)device.open();
  CHECK_THAT(test::vendor_message_of([&] { device.prepare(preparation); }),
             Contains("the initialisation was interrupted; the motors are off"));
  CHECK(script.happened("drd_stop"));
  CHECK(script.happened("stop"));
  CHECK(script.happened("forces_off"));
  CHECK(script.happened("init_over"));
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(45));
}

TEST_CASE("An initialisation that does not end when told so is left behind") {
  const test::VendorScript script("initialised 0\ninit_ms 8000\nstubborn 1\n");
  DevicePreparation preparation;
  preparation.may_move = true;
  preparation.interrupted = [&] { return script.happened("moved"); };
  {
    ForceDimension device(TPM_STAND_IN_DHD);
    (void)device.open();
    CHECK_THAT(test::vendor_message_of([&] { device.prepare(preparation); }),
               Contains("does not end"));
    CHECK(script.happened("drd_stop"));
    CHECK(script.happened("forces_off"));
  }
  CHECK_FALSE(script.happened("close"));  // a call is in the library still
  for (int i = 0; i < 3000 && !script.happened("init_over"); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
}

TEST_CASE("A session that cannot be prepared leaves no recording, and the next one runs") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  {
    const test::VendorScript script(operator_lines(session, folder) + "initialised 0\n");
    SessionRunOptions options;
    options.recording = folder / "r";
    CHECK_THROWS_WITH(run_session(session, stand_in(), options), Contains("--may-move"));
    CHECK_FALSE(std::filesystem::exists(folder / "r"));
  }
  const test::VendorScript script(operator_lines(session, folder));
  CHECK(ran(session, stand_in(), folder / "r").run.outcome.cause == StopCause::finished);
}

TEST_CASE("A file that was measured on another device, or on a simulated one, is refused") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  const test::VendorScript script(operator_lines(session, folder));
  DeviceChoice device = stand_in();
  const auto said_of = [&](const char* key, const Json& value) {
    Json file = read_json(stand_in().file);
    file[Json::json_pointer(key)] = value;
    device.file = folder / "device.json";
    write_file(device.file, to_text(file));
    SessionRunOptions options;
    options.recording = folder / "r";
    return test::vendor_message_of([&] { (void)run_session(session, device, options); });
  };
  CHECK_THAT(said_of("/serial", "1"), Contains("device.json: key /serial: was measured on the "
                                               "device '1', and this is '4711'"));
  CHECK_THAT(said_of("/measurement", Json{{"simulated_device", true}}),
             Contains("key /measurement/simulated_device: was measured on a simulated device"));
  CHECK_THAT(said_of("/name", "omega.3"), Contains("device.json: key /name: was measured on the "
                                                   "device 'omega.3', and this is 'omega.7'"));
  CHECK_THAT(said_of("/serial", ""),
             Contains("device.json: key /serial: is missing: what was measured may be of another "
                      "device than this, '4711'; expected the file of this device"));
  CHECK_FALSE(std::filesystem::exists(folder / "r"));
}

TEST_CASE("A file in which nothing was measured is for any device of its kind") {
  Json json = test::short_session();
  for (const char* key : {"E1", "E2", "Eprime"}) {
    json["model"]["scene"]["material"][key] = "2 kPa";  // the gate lets it pass at 20 ms
  }
  json.erase("creep");
  const HilSession session = test::parsed(json);
  const test::TempFolder folder;
  const test::VendorScript script(operator_lines(session, folder));
  DeviceChoice device = stand_in();
  device.file = folder / "device.json";
  write_file(device.file, R"({"device": "omega7", "name": "any Omega", "limits": {"force_N": 8},
                              "delay": {"provenance": "assumed", "largest_s": 0.001}})");
  CHECK(ran(session, device, folder / "r").run.device.serial == "4711");  // and not refused
}

TEST_CASE("The device is told the session's limit of the force") {
  const HilSession session =
      test::parsed(test::with(test::short_session(), "/limits/force", "3 N"));
  const test::TempFolder folder;
  const test::VendorScript script(operator_lines(session, folder));
  (void)ran(session, stand_in(), folder / "r");
  CHECK(script.happened("max_force_3000"));
}

TEST_CASE("Without libdrd nobody can tell whether a device is initialised") {
  const test::VendorScript script("");
  DevicePreparation preparation;
  ForceDimension device(TPM_STAND_IN_DHD_WITHOUT_DRD);
  (void)device.open();
  CHECK_THAT(test::vendor_message_of([&] { device.prepare(preparation); }),
             Contains("cannot tell"));
  preparation.take_as_ready = true;
  device.prepare(preparation);
}

TEST_CASE("A session through the library gives the forces of the simulated device, bit for bit") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  const Ran direct = ran(session, {}, folder / "direct");
  const test::VendorScript script(operator_lines(session, folder) + "period 0.001\n");
  const Ran loaded = ran(session, stand_in(), folder / "loaded");
  CHECK(loaded.run.outcome.cause == StopCause::finished);
  CHECK(direct.recording.simulated());
  CHECK_FALSE(loaded.recording.simulated());
  REQUIRE(loaded.recording.rows.size() == direct.recording.rows.size());
  double peak = 0.0;
  for (std::size_t i = 0; i < direct.recording.rows.size(); ++i) {
    const ServoRecord& a = direct.recording.rows[i];
    const ServoRecord& b = loaded.recording.rows[i];
    REQUIRE(a.commanded_N[2] == b.commanded_N[2]);
    REQUIRE(a.position_m[2] == b.position_m[2]);
    peak = std::max(peak, a.commanded_N[2]);
  }
  CHECK(peak > 0.4);
  CHECK(script.happened("stop"));
  CHECK(script.happened("forces_off"));
  CHECK(script.happened("close"));
}

TEST_CASE("An older status with 16 entries is read") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  const test::VendorScript script(operator_lines(session, folder) + "entries 16\n");
  CHECK(ran(session, stand_in(), folder / "r").run.outcome.cause == StopCause::finished);
}

TEST_CASE("Time guards and saturation are counted and the session goes on") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  const test::VendorScript script(
      operator_lines(session, folder) +
      "fault time_guard 350 18\nfault time_guard 750 3\nfault saturated 450 7\n");
  const Ran r = ran(session, stand_in(), folder / "r");
  CHECK(r.run.outcome.cause == StopCause::finished);
  CHECK(r.run.outcome.counts.time_guards == 21);
  CHECK(r.run.outcome.counts.saturations == 7);
  int flagged = 0;
  for (const ServoRecord& row : r.recording.rows)
    flagged += (row.flags & kTimeGuarded) != 0 ? 1 : 0;
  CHECK(flagged == 21);
}

TEST_CASE("Positions of earlier calls for more than 20 ms end the session") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  const test::VendorScript script(operator_lines(session, folder) + "fault time_guard 350 400\n");
  const Ran r = ran(session, stand_in(), folder / "r");
  CHECK(r.run.outcome.cause == StopCause::communication);
  CHECK(r.run.outcome.counts.time_guards == 21);
  CHECK(script.happened("forces_off"));
}

TEST_CASE("Each fault ends in a safe stop within 10 ms of session, with its cause") {
  struct Case {
    const char* fault;
    StopCause cause;
    const char* event;
  };
  const Case fault = GENERATE(Case{"unplugged", StopCause::unplugged, "unplugged"},
                              Case{"watchdog", StopCause::watchdog, "watchdog"},
                              Case{"velocity", StopCause::velocity, "velocity"},
                              Case{"communication", StopCause::communication, "communication"},
                              Case{"status", StopCause::communication, "stop"},
                              Case{"not_available", StopCause::communication, "stop"},
                              Case{"nan", StopCause::position_not_finite, "nan"});
  CAPTURE(fault.fault);
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  constexpr std::uint64_t kAt = 1777;
  const test::VendorScript script(operator_lines(session, folder) + "fault " + fault.fault + " " +
                                  std::to_string(kAt + kWaitedCycles) + " 1\n");
  const Ran r = ran(session, stand_in(), folder / "r");
  CHECK(script.happened(fault.event));
  CHECK(r.run.outcome.cause == fault.cause);
  // Nothing is lost before it, and the last row tells the cause.
  REQUIRE(r.recording.rows.size() == r.run.outcome.cycles + 1);
  CHECK(r.recording.rows.back().stop == fault.cause);
  CHECK(r.recording.rows.back().cycle >= kAt);
  CHECK(r.recording.rows.back().cycle <= kAt + 10);
  CHECK(r.recording.closed);
  CHECK(r.recording.closing.at("cause") == to_string(fault.cause));
  CHECK(script.happened("stop"));
  CHECK(script.happened("forces_off"));
}

TEST_CASE("A session that asks for more than a device can take is refused") {
  const test::VendorScript script("type 60\n");
  DeviceChoice falcon = stand_in();
  falcon.kind = "falcon";
  falcon.file.clear();
  const HilSession session =
      test::parsed(test::with(test::short_session(), "/limits/force", "9 N"));
  CHECK_THROWS_WITH(run_session(session, falcon, {}),
                    Contains("limits/force is 9 N; expected at most 8 N"));
}

TEST_CASE("Gripper, buttons and what was noted stand in the recording") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  {
    const test::VendorScript script(operator_lines(session, folder) +
                                    "gripper 0.0125\nbuttons 3\n");
    SessionRunOptions options;
    options.recording = folder / "r";
    options.notes = {"2026-11-23", "op-1", "s 7"};
    (void)run_session(session, stand_in(), options);
    CHECK(script.happened("gripper_force_0"));
    const HilRecording recording = read_recording(folder / "r");
    CHECK(recording.header.at("notes").at("subject_code") == "s 7");
    CHECK(recording.rows.at(500).gripper_m == 0.0125F);
    CHECK(recording.rows.at(501).buttons == 3);
    export_recording(recording, "", folder / "r.h5");
    const Hdf5Reader file(folder / "r.h5");
    CHECK(file.attribute("/header/notes", "operator_code") == "op-1");
    CHECK(file.numbers("/rows/gripper_m").at(500) == static_cast<double>(0.0125F));
  }
  const test::VendorScript script(operator_lines(session, folder));
  const Ran r = ran(session, stand_in(), folder / "without");
  CHECK_FALSE(script.happened("gripper_force_0"));
  CHECK(std::isnan(r.recording.rows.at(500).gripper_m));
  CHECK(r.recording.rows.at(500).buttons == 0);
  CHECK(std::isnan(r.recording.rows.at(500).grip[0]));
}

TEST_CASE("The device is told how it stands, and what cannot be told is refused") {
  const test::TempFolder folder;
  const Json mounted = test::with(test::short_session(), "/mounting",
                                  {{"effector_mass_kg", 0.12}, {"base_angle_x", "30 deg"}});
  const HilSession session = test::parsed(mounted);
  {
    const test::VendorScript script(operator_lines(session, folder));
    (void)ran(session, stand_in(), folder / "r");
    CHECK(script.happened("effector_mass_120"));
    CHECK(script.happened("base_angle_x_524"));
  }
  const HilSession other =
      test::parsed(test::with(test::short_session(), "/mounting", {{"base_angle_z", "1 rad"}}));
  const test::VendorScript script(operator_lines(other, folder));
  CHECK_THAT(test::vendor_message_of([&] { (void)ran(other, stand_in(), folder / "z"); }),
             Contains("has no dhdSetBaseAngleZRad"));
  CHECK_FALSE(std::filesystem::exists(folder / "z"));
}

TEST_CASE("A session that waits for a word begins with a button, and not without") {
  const test::TempFolder folder;
  const Json asked =
      test::with(test::short_session(), "/start", {{"confirm", true}, {"limit", "2 s"}});
  const HilSession session = test::parsed(asked);
  {
    const test::VendorScript script(operator_lines(session, folder) + "buttons 1\n");
    CHECK(ran(session, stand_in(), folder / "r").run.outcome.cause == StopCause::finished);
  }
  const test::VendorScript script(operator_lines(session, folder));
  CHECK(ran(session, stand_in(), folder / "s").run.outcome.cause == StopCause::not_in_place);
  CHECK(ran(session, {}, folder / "simulated").run.outcome.cause == StopCause::finished);
}

TEST_CASE("The whole way is walked through a library, and said not to be without one") {
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(test::short_session()));
  const HilSession session = test::parsed(test::short_session());
  const test::VendorScript script(operator_lines(session, folder) + "initialised 0\n");
  const std::string build = std::filesystem::path(TPM_TEST_PROGRAM).parent_path();
  const auto walked = [&](const std::string& arguments) {
    const std::string line = "TPM_BUILD='" + build + "' TPM_SESSION='" + (folder / "session.json") +
                             "' TPM_RUN_OPTIONS='--clock virtual --device-file " TPM_TEST_SOURCE_DIR
                             "/tests/fixtures/stand_in_device.json' '" TPM_TEST_SOURCE_DIR
                             "/scripts/try_vendor_library.sh' " +
                             arguments + " > '" + (folder / "said") + "' 2>&1";
    const int status = std::system(line.c_str());
    return std::pair(WEXITSTATUS(status), read_file(folder / "said"));
  };
  const auto [none, nothing] = walked("");
  CHECK(none == 1);
  CHECK_THAT(nothing, Contains("not run: no vendor library"));
  const auto [code, said] = walked("'" TPM_STAND_IN_DHD "' --may-move");
  CAPTURE(said);
  // Whether this machine is fit for a session is not asked here.
  CHECK_THAT(said, Contains("0        omega.7, serial 4711: --device omega7 --serial 4711") &&
                       Contains("drdIsInitialized answered 0") &&
                       Contains("drdAutoInit answered 0") && Contains("== tpm hil verify"));
  CHECK_THAT(said, !Contains("did not go through: run") && !Contains("check run") &&
                       !Contains("verify\n-- exit code 1"));
}

TEST_CASE("A recording of the stand-in behind a network is labelled as simulated") {
  const HilSession session = test::parsed(test::short_session());
  const test::TempFolder folder;
  const test::VendorScript script(operator_lines(session, folder) + "com_mode 4\n");
  const Ran r = ran(session, stand_in(), folder / "r");
  CHECK(r.recording.simulated());
  CHECK_THAT(device_line(r.recording), Contains("SIMULATED DEVICE"));
}

}  // namespace
}  // namespace tpm::haptics
