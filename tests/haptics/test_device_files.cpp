// Device description files: those that are shipped, what they bring, and what is refused.
#include <catch2/catch.hpp>

#include "hil_scenes.hpp"
#include "refusal.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/device_file.hpp"
#include "tpm/haptics/device/device_keys.hpp"
#include "tpm/haptics/session/loop_contact.hpp"
#include "tpm/haptics/session/session_run.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

TEST_CASE("Ten devices have a shipped file, in which every limit says that it is assumed") {
  CHECK(shipped_devices() == std::vector<std::string>{"delta3", "falcon", "inverse3", "lambda3",
                                                      "lambda6", "lambda7", "omega3", "omega6",
                                                      "sigma3", "sigma7"});
  for (const std::string& kind : shipped_devices()) {
    CAPTURE(kind);
    const DeviceFile file = shipped_device_file(kind).value();
    CHECK(file.provenance.size() == 6);
    for (const auto& [limit, source] : file.provenance) CHECK_THAT(source, StartsWith("assumed: "));
    const DeviceLimits limits = limits_of(kind);
    CHECK(limits.kind == kind);
    CHECK_FALSE(limits.tried);
    CHECK(limits.hardware());
    CHECK_FALSE(limits.measured_delay_s.has_value());
    CHECK_FALSE(limits.measured_friction_N_s_per_m.has_value());
    // No limit of a device that nobody has tried is above what is known of the Omega.7, but the
    // stiffness of the lambda.7 and the reach of the Inverse3.
    const DeviceLimits known = limits_of("omega7");
    CHECK(limits.force_N <= known.force_N);
    if (kind != "inverse3") CHECK(limits.reach_m <= known.reach_m);
    CHECK(limits.slew_N_per_s <= known.slew_N_per_s);
    if (kind != "lambda7") CHECK(limits.stiffness_N_per_m <= known.stiffness_N_per_m);
  }
  CHECK(limits_of("falcon").reach_m == 0.04);
  CHECK(limits_of("sigma7").stiffness_N_per_m == 4000.0);
}

TEST_CASE("A kind of device is known by itself, by a shipped file, or not at all") {
  CHECK(device_kinds().size() == 13);
  CHECK(limits_of("omega7").tried);
  CHECK_FALSE(shipped_device_file("omega7").has_value());
  CHECK_THAT(test::refusal_of([] { (void)limits_of("gloves"); }),
             Contains("'gloves'") && Contains("virtual, replay, omega7, delta3, falcon"));
  // A name is no way to another folder.
  CHECK_THAT(test::refusal_of([] { (void)limits_of("../hil_liver"); }), Contains("../hil_liver"));
  CHECK_THAT(test::refusal_of([] { (void)limits_of(""); }), Contains("one of"));
}

TEST_CASE("The file of a device that only it describes states every limit") {
  Json json = read_json(share_dir() / "configs" / "devices" / "falcon.json");
  CHECK(limits_in(parse_device_file(json, "f")).force_N == 8.0);
  json["limits"].erase("force_N");
  CHECK_THAT(test::refusal_of([&] { (void)parse_device_file(json, "f"); }),
             Contains("f: key /limits/provenance: of 'force_N', which is not stated"));
  json["limits"]["provenance"].erase("force_N");
  CHECK_THAT(test::refusal_of([&] { (void)limits_in(parse_device_file(json, "f")); }),
             Contains("f: key /limits: states no force_N"));
}

TEST_CASE("A device file is written as it is read") {
  Json json = read_json(share_dir() / "configs" / "devices" / "lambda7.json");
  json.erase("$schema");  // which every kind of file may name
  const DeviceKeys keys = device_block().read(json, DocumentPlace{"l"});
  CHECK(device_block().write(keys) == json);
}

Json measured_file() {
  return {{"device", "omega7"},
          {"delay",
           {{"provenance", "measured"},
            {"mean_s", 0.001},
            {"largest_s", 0.0012},
            {"jitter_s", 1e-4},
            {"resolution_s", 5e-4}}},
          {"viscous_friction",
           {{"provenance", "measured"}, {"lower_95_N_s_per_m", 0.2}, {"estimate_N_s_per_m", 0.25}}},
          {"coulomb_friction", {{"provenance", "measured"}, {"interval_N", {0.0, 0.01}}}},
          {"moving_mass",
           {{"provenance", "measured"}, {"mass_kg", 0.3}, {"interval_kg", {0.28, 0.32}}}},
          {"measurement", {{"simulated_device", false}}}};
}

TEST_CASE("A device file whose numbers contradict each other is refused") {
  const DeviceFile sound = parse_device_file(measured_file(), "d");
  CHECK(sound.measured_period_s == 1e-3);
  CHECK_FALSE(sound.simulated);
  struct Row {
    const char* key;
    Json value;
    const char* words;
  };
  const Row rows[] = {
      {"/delay/mean_s", 0.02, "d: key /delay/mean_s: 0.02 is above largest_s, 0.0012"},
      {"/delay/jitter_s", 0.02, "d: key /delay/jitter_s: 0.02 is above largest_s, 0.0012"},
      {"/viscous_friction/lower_95_N_s_per_m", 5.0, "5 is above estimate_N_s_per_m, 0.25"},
      {"/viscous_friction/lower_95_N_s_per_m", 50.0, "50; expected 0 to 10"},
      {"/viscous_friction/estimate_N_s_per_m", -1.0, "0.2 is above estimate_N_s_per_m, -1"},
      {"/coulomb_friction/interval_N", Json{0.1, 0.0}, "is 0.1 to 0"},
      {"/coulomb_friction/interval_N", Json{-1.0, 0.0}, "is -1 to 0"},
      {"/moving_mass/interval_kg", Json{0.4, 0.2}, "is 0.4 to 0.2"},
      {"/moving_mass/mass_kg", 3.0, "3 lies outside interval_kg"}};
  for (const Row& row : rows) {
    Json json = measured_file();
    json[Json::json_pointer(row.key)] = row.value;
    CAPTURE(row.key, row.value.dump());
    CHECK_THAT(test::refusal_of([&] { (void)parse_device_file(json, "d"); }), Contains(row.words));
  }
}

TEST_CASE("What was measured on a simulated device says so") {
  Json json = measured_file();
  json["measurement"]["simulated_device"] = true;
  CHECK(parse_device_file(json, "d").simulated);
  json.erase("measurement");
  CHECK_FALSE(parse_device_file(json, "d").simulated);
}

TEST_CASE("A limit keeps what it is known by, whatever file is named beside it") {
  // A file of tpm hil identify has no limits: those of the kind stay as assumed as they were.
  const DeviceLimits kind = limits_of("inverse3");
  const DeviceFile measured = parse_device_file(Json::parse(R"({"device": "inverse3"})"), "d");
  CHECK(limits_by_file(kind, measured).known_by("force_N") == kind.known_by("force_N"));
  CHECK_THAT(std::string(kind.known_by("force_N")), Contains("assumed"));
  const DeviceFile said = parse_device_file(
      Json::parse(R"({"device": "inverse3", "limits": {"force_N": 2, "reach_m": 0.05,
        "provenance": {"force_N": "measured with a scale"}}})"),
      "d");
  CHECK(limits_by_file(kind, said).known_by("force_N") == "measured with a scale");
  CHECK_THAT(std::string(limits_by_file(kind, said).known_by("reach_m")),
             Contains("names no source"));
  CHECK(limits_by_file(kind, said).known_by("stiffness_N_per_m") ==
        kind.known_by("stiffness_N_per_m"));
}

TEST_CASE("A device that only its file knows has the limits of its file") {
  DeviceFile file = parse_device_file(Json::parse(R"({"device": "plugin", "limits": {
    "force_N": 5, "reach_m": 0.06, "stiffness_N_per_m": 900, "damping_N_s_per_m": 4,
    "slew_N_per_s": 800, "least_ramp_in_s": 0.2}})"),
                                      "d");
  CHECK(limits_from(file).stiffness_N_per_m == 900.0);
  CHECK(limits_from(file, "plugin").hardware());
  CHECK(limits_from(parse_device_file(Json{{"device", "falcon"}}, "d")).reach_m == 0.04);
  CHECK_THAT(test::refusal_of([&] { (void)limits_from(file, "omega7"); }),
             Contains("is of 'plugin', not of 'omega7'"));
  file.force_N.reset();
  CHECK_THAT(test::refusal_of([&] { (void)limits_from(file); }), Contains("states no force_N"));
}

TEST_CASE("A rehearsal stands for the device of its file") {
  const test::TempFolder folder;
  write_file(folder / "d.json", R"({"device": "falcon", "limits": {"force_N": 2}})");
  const DeviceFile file = read_device_file(folder / "d.json");
  CHECK(limits_by_file(limits_of(file.kind), file).force_N == 2.0);
  CHECK(limits_by_file(limits_of(file.kind), file).reach_m == 0.04);
  DeviceChoice rehearsal;
  rehearsal.file = folder / "d.json";
  SessionRunOptions options;
  options.recording = folder / "r.tpmrec";
  const SessionRun run = run_session(test::parsed(test::short_session()), rehearsal, options);
  CHECK(run.hardware_kind == "falcon");
  REQUIRE(run.on_hardware.has_value());
  CHECK(run.on_hardware->largest_N_per_m == 3000.0);
  CHECK_FALSE(run.on_hardware->acceptable());  // nobody has measured its delay
  write_file(folder / "high.json", R"({"device": "falcon", "limits": {"reach_m": 0.05}})");
  CHECK_THAT(test::refusal_of([&] {
               const DeviceFile high = read_device_file(folder / "high.json");
               (void)limits_by_file(limits_of(high.kind), high);
             }),
             Contains("0.05; expected at most 0.04, the limit of 'falcon'"));
}

}  // namespace
}  // namespace tpm::haptics
