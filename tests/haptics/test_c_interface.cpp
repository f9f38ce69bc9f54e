// The C interface for haptic loops: libtpmkit_haptics, linked as a stranger would.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "counted_allocations.hpp"
#include "hil_scenes.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/session/session_run.hpp"
#include "tpmkit/haptics.h"
#include "tpmkit/model.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

/// Of a loop that moves nothing.
tpm_haptics_options without_motors() {
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  std::snprintf(options.device, sizeof options.device, "virtual");
  return options;
}

/// A contact of a session that is written to a file first.
class Opened {
 public:
  explicit Opened(const Json& json, tpm_haptics_options options = without_motors()) {
    options.no_start_gate = 1;
    write_file(folder_ / "session.json", to_text(json));
    open(folder_ / "session.json", options);
  }
  explicit Opened(const std::string& file) { open(file, without_motors()); }
  ~Opened() { tpm_haptics_close(contact_); }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;

  operator tpm_haptics_contact*() const { return contact_; }  // NOLINT: used as one
  [[nodiscard]] tpm_haptics_info info() const {
    tpm_haptics_info info = TPM_HAPTICS_INFO_INIT;
    CHECK(tpm_haptics_get_info(contact_, &info) == TPM_HAPTICS_OK);
    return info;
  }
  [[nodiscard]] tpm_haptics_state state() const {
    tpm_haptics_state state = TPM_HAPTICS_STATE_INIT;
    CHECK(tpm_haptics_get_state(contact_, &state) == TPM_HAPTICS_OK);
    return state;
  }
  /// The push back at a depth.
  double push_back_N(double depth_m, int* answer = nullptr) const {
    const double position_m[3] = {0.0, 0.0, -depth_m};
    double force_N[3] = {1.0, 1.0, 1.0};
    const int code = tpm_haptics_step(contact_, position_m, force_N);
    if (answer != nullptr) *answer = code;
    CHECK(force_N[0] == 0.0);
    CHECK(force_N[1] == 0.0);
    return force_N[2];
  }

 private:
  void open(const std::string& file, const tpm_haptics_options& options) {
    char why[TPM_HAPTICS_MESSAGE] = "unchanged";
    const int code = tpm_haptics_open(file.c_str(), &options, &contact_, why, sizeof why);
    CAPTURE(why);
    REQUIRE(code == TPM_HAPTICS_OK);
    CHECK(std::string(why).empty());
  }
  test::TempFolder folder_;
  tpm_haptics_contact* contact_ = nullptr;
};

std::string refused(const std::string& file, int expected,
                    tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT) {
  char why[TPM_HAPTICS_MESSAGE];
  auto* contact = reinterpret_cast<tpm_haptics_contact*>(&options);  // NOLINT: must be overwritten
  CHECK(tpm_haptics_open(file.c_str(), &options, &contact, why, sizeof why) == expected);
  CHECK(contact == nullptr);
  CHECK(std::string(why).find('\n') == std::string::npos);
  return why;
}

TEST_CASE("A contact opened in C answers as the closed form of the paper's element") {
  const Opened contact(test::short_session());
  constexpr int kRest = 600, kRamp = 1000, kHold = 1000;
  for (int i = 0; i <= kRest; ++i) CHECK(contact.push_back_N(0.0) == 0.0);
  std::vector<double> times_s, forces_N;
  for (int i = 1; i <= kRamp + kHold; ++i) {
    times_s.push_back(1e-3 * i);
    forces_N.push_back(contact.push_back_N(4e-6 * std::min(i, kRamp)));
  }
  TpmParameters material;
  material.eta1_Pa_s = 2.4e4;  // the other numbers of the session are the presets
  const Response exact =
      make_model("closed_form")
          ->respond(ramp_and_hold(4e-3, 4e-3, 1.0), times_s, to_vector(material), Want::values);
  double worst_N = 0.0;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    worst_N = std::max(worst_N, std::abs(forces_N[i] - exact.value[static_cast<Eigen::Index>(i)]));
  }
  CHECK(exact.value.maxCoeff() > 0.4);
  CHECK(worst_N < 1e-10);
}

TEST_CASE("A contact opened in C sends the forces of tpm hil run, to the bit") {
  const Json session =
      GENERATE(test::short_session(), test::network_session("condensed"), test::slide_session());
  CAPTURE(session.at("model").dump());
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(session));
  SessionRunOptions options;
  options.recording = folder / "r";
  REQUIRE(run_session(read_session(folder / "session.json"), {}, options).outcome.cause ==
          StopCause::finished);
  const HilRecording recording = read_recording(folder / "r");
  const Opened contact(session);  // with the friction and the delay of the run
  std::size_t different = 0, felt = 0;
  for (const ServoRecord& row : recording.rows) {
    if (row.stop != StopCause::none) break;
    double force_N[3];
    CHECK(tpm_haptics_step(contact, row.position_m, force_N) == TPM_HAPTICS_OK);
    different += std::equal(force_N, force_N + 3, row.commanded_N) ? 0 : 1;
    felt += force_N[2] > 0.01 ? 1 : 0;
  }
  CHECK(felt > 300);
  CHECK(different == 0);
}

TEST_CASE("A step in C takes nothing from the heap and gives nothing back") {
  const Json session = GENERATE(
      test::short_session(), test::network_session("condensed"), test::network_session("network"),
      test::slide_session(), Json::parse(read_file(TPM_TEST_SOURCE_DIR "/configs/hil_law.json")));
  CAPTURE(session.at("model").dump());
  const Opened contact(session);
  tpm_haptics_state state = TPM_HAPTICS_STATE_INIT;
  double most_N = 0.0;
  int answer = TPM_HAPTICS_OK;
  const testing::HeapWatch heap;
  for (int i = 0; i < 1500 && answer == TPM_HAPTICS_OK; ++i) {
    const double position_m[3] = {0.0, 0.0, 2e-3 - 4e-6 * i};
    double force_N[3];
    answer = tpm_haptics_step_after(contact, i % 100 == 0 ? 1 : 0, position_m, force_N);
    (void)tpm_haptics_get_state(contact, &state);
    most_N = std::max(most_N, force_N[2]);
  }
  const long calls = heap.calls();
  CHECK(answer == TPM_HAPTICS_OK);
  CHECK(most_N > 0.01);
  CHECK(calls == 0);
}

TEST_CASE("What is wrong with a file is a code and one line in C") {
  const test::TempFolder folder;
  CHECK_THAT(refused(folder / "none.json", TPM_HAPTICS_BAD_INPUT), Contains("none.json"));
  write_file(folder / "other.json", "{\"a\": 1}");
  CHECK_THAT(refused(folder / "other.json", TPM_HAPTICS_BAD_INPUT),
             Contains("other.json: is neither a session nor a law; expected"));
  write_file(folder / "key.json",
             to_text(test::with(test::short_session(), "/indentations/holt", "2 s")));
  CHECK_THAT(refused(folder / "key.json", TPM_HAPTICS_BAD_INPUT), Contains("holt"));
  const Json stiff = test::with(test::short_session(), "/model/scene/material/E2", "12 MPa");
  write_file(folder / "stiff.json", to_text(stiff));
  CHECK_THAT(refused(folder / "stiff.json", TPM_HAPTICS_REFUSED), Contains("unstable"));

  write_file(folder / "good.json", to_text(test::short_session()));
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  std::snprintf(options.device, sizeof options.device, "gloves");
  CHECK_THAT(refused(folder / "good.json", TPM_HAPTICS_USAGE, options),
             StartsWith("device: 'gloves'; expected one of virtual, omega7, "));
  // Nothing is replayed in a loop of one's own, and a plugin's limits are those of a file.
  for (const char* const kind : {"replay", "plugin"}) {
    std::snprintf(options.device, sizeof options.device, "%s", kind);
    CHECK_THAT(
        refused(folder / "good.json", TPM_HAPTICS_USAGE, options),
        StartsWith(std::string("device: '") + kind + "'; expected one of virtual, omega7, ") &&
            Contains("device_file"));
  }
  for (const double rate_Hz : {100.0, -1.0, 4001.0, std::numeric_limits<double>::quiet_NaN()}) {
    options = TPM_HAPTICS_OPTIONS_INIT;
    options.rate_Hz = rate_Hz;
    CHECK_THAT(refused(folder / "good.json", TPM_HAPTICS_USAGE, options),
               StartsWith("rate_Hz: ") && Contains("expected 500 to 4000 Hz, or 0 for that of"));
  }
  for (const double longest_s : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
    options = TPM_HAPTICS_OPTIONS_INIT;
    options.longest_s = longest_s;
    CHECK_THAT(refused(folder / "good.json", TPM_HAPTICS_USAGE, options),
               StartsWith("longest_s: "));
  }
  options = TPM_HAPTICS_OPTIONS_INIT;
  options.version = TPM_HAPTICS_VERSION + 1;  // may hold an option that is not known here
  CHECK_THAT(refused(folder / "good.json", TPM_HAPTICS_USAGE, options), Contains("version"));

  char why[8];
  tpm_haptics_contact* contact = nullptr;
  CHECK(tpm_haptics_open((folder / "none.json").c_str(), nullptr, &contact, why, sizeof why) ==
        TPM_HAPTICS_BAD_INPUT);
  CHECK(std::strlen(why) == sizeof why - 1);
  CHECK(tpm_haptics_open(nullptr, nullptr, &contact, nullptr, 0) == TPM_HAPTICS_USAGE);
}

TEST_CASE("In C there is no force without a contact or a position") {
  const Opened contact(test::short_session());
  const double air_m[3] = {0.0, 0.0, 0.0};
  for (const int way : {0, 1, 2, 3}) {
    CAPTURE(way);
    double force_N[3] = {7.0, 7.0, 7.0};
    const int answer = way == 0   ? tpm_haptics_step(nullptr, air_m, force_N)
                       : way == 1 ? tpm_haptics_step(contact, nullptr, force_N)
                       : way == 2 ? tpm_haptics_step_at(nullptr, 0.0, air_m, force_N)
                                  : tpm_haptics_step_at(contact, 0.0, nullptr, force_N);
    CHECK(answer == TPM_HAPTICS_USAGE);
    CHECK(std::count(force_N, force_N + 3, 0.0) == 3);
  }
}

TEST_CASE("Structs of C keep to the size that the caller has") {
  const Opened contact(test::short_session());
  tpm_haptics_state state = TPM_HAPTICS_STATE_INIT;
  state.size = offsetof(tpm_haptics_state, missed) - 8;
  CHECK(tpm_haptics_get_state(contact, &state) == TPM_HAPTICS_USAGE);
  // A caller of the first version, whose struct is shorter.
  state = TPM_HAPTICS_STATE_INIT;
  state.size = offsetof(tpm_haptics_state, missed);
  state.missed = 17;
  CHECK(tpm_haptics_get_state(contact, &state) == TPM_HAPTICS_OK);
  CHECK(state.missed == 17);
  state = TPM_HAPTICS_STATE_INIT;
  state.version = 0;
  CHECK(tpm_haptics_get_state(contact, &state) == TPM_HAPTICS_USAGE);

  // A caller of a later version, whose struct is longer: what this library does not know stays.
  struct Later {
    tpm_haptics_info info;
    double added;
  } later{TPM_HAPTICS_INFO_INIT, 17.0};
  later.info.size = sizeof later;
  later.info.version = TPM_HAPTICS_VERSION + 1;
  CHECK(tpm_haptics_get_info(contact, &later.info) == TPM_HAPTICS_OK);
  CHECK(later.added == 17.0);
  CHECK(later.info.size == sizeof later);
  CHECK(later.info.period_s == 1e-3);

  double force_N[3];
  CHECK(tpm_haptics_step(nullptr, force_N, force_N) == TPM_HAPTICS_USAGE);
  CHECK(tpm_haptics_step(contact, nullptr, force_N) == TPM_HAPTICS_USAGE);
  std::vector<double> few(3);
  CHECK(tpm_haptics_positions(contact, few.data(), 1) == TPM_HAPTICS_USAGE);
  tpm_haptics_close(nullptr);
}

TEST_CASE("A contact in C stops at a position that no hand reaches, until it is reset") {
  const Opened contact(test::short_session());
  for (int i = 0; i < 600; ++i) (void)contact.push_back_N(0.0);
  int answer = 0;
  for (int i = 1; i <= 100; ++i) CHECK(contact.push_back_N(1e-5 * i, &answer) > 0.0);
  CHECK(answer == TPM_HAPTICS_OK);
  CHECK((contact.state().flags & TPM_HAPTICS_TOUCHING) != 0);
  const double far_m = GENERATE(0.05, std::numeric_limits<double>::quiet_NaN());
  CHECK(contact.push_back_N(far_m, &answer) == 0.0);
  CHECK(answer == TPM_HAPTICS_STOPPED);
  CHECK(contact.push_back_N(1e-3, &answer) == 0.0);
  CHECK(answer == TPM_HAPTICS_STOPPED);
  CHECK(contact.state().cause ==
        (std::isnan(far_m) ? TPM_HAPTICS_POSITION_NOT_FINITE : TPM_HAPTICS_POSITION_JUMPED));
  CHECK(tpm_haptics_reset(contact) == TPM_HAPTICS_OK);
  CHECK(contact.push_back_N(0.0, &answer) == 0.0);
  CHECK(answer == TPM_HAPTICS_OK);
  CHECK(contact.state().cause == TPM_HAPTICS_RUNNING);
}

TEST_CASE("A contact in C waits until the tool is in the air and at rest, unless told otherwise") {
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(test::short_session()));
  const Opened contact(folder / "session.json");
  CHECK(contact.push_back_N(2e-3) == 0.0);
  CHECK((contact.state().flags & TPM_HAPTICS_IN_TISSUE) != 0);
  int waited = 0;
  while ((contact.push_back_N(-2e-3), contact.state().flags & TPM_HAPTICS_WAITING) != 0) ++waited;
  CHECK(waited >= 250);
  CHECK(waited < 300);
  double most_N = 0.0;
  for (int i = 0; i < 1000; ++i) most_N = std::max(most_N, contact.push_back_N(-2e-3 + 4e-6 * i));
  CHECK(most_N > 0.1);
}

TEST_CASE("Periods that the caller missed are lived through") {
  const Opened every(test::short_session()), some(test::short_session());
  for (int i = 0; i <= 600; ++i) {
    (void)every.push_back_N(0.0);
    (void)some.push_back_N(0.0);
  }
  double force_N[3] = {}, whole_N = 0.0;
  for (int i = 1; i <= 500; ++i) {
    whole_N = every.push_back_N(4e-6 * i);
    if (i % 5 != 0) continue;
    const double position_m[3] = {0.0, 0.0, -4e-6 * i};
    CHECK(tpm_haptics_step_after(some, 4, position_m, force_N) == TPM_HAPTICS_OK);
  }
  CHECK(whole_N > 0.1);
  CHECK(force_N[2] == Approx(whole_N).epsilon(1e-9));
  CHECK(some.state().time_s == Approx(every.state().time_s));
}

TEST_CASE("A loop in C that is too slow is stopped, and one whose clock goes back is told") {
  const Opened slow(test::short_session());
  double force_N[3] = {};
  const double air_m[3] = {0.0, 0.0, 2e-3};
  int answer = TPM_HAPTICS_OK;
  for (int i = 0; i < 1000 && answer == TPM_HAPTICS_OK; ++i) {
    answer = tpm_haptics_step_at(slow, 2e-3 * i, air_m, force_N);
  }
  CHECK(answer == TPM_HAPTICS_STOPPED);
  CHECK(slow.state().cause == TPM_HAPTICS_LATE);
  CHECK(slow.state().missed >= 100);
  const Opened contact(test::short_session());
  CHECK(tpm_haptics_step_at(contact, 5.0, air_m, force_N) == TPM_HAPTICS_OK);
  CHECK(tpm_haptics_step_at(contact, 4.999, air_m, force_N) == TPM_HAPTICS_USAGE);
  for (const double no_time_s : {std::numeric_limits<double>::quiet_NaN(), 1e15}) {
    CHECK(tpm_haptics_step_at(contact, no_time_s, air_m, force_N) == TPM_HAPTICS_USAGE);
  }
  CHECK(tpm_haptics_step_at(contact, 5.001, air_m, force_N) == TPM_HAPTICS_OK);
}

TEST_CASE("A device file in C brings the measured delay, and what it allows") {
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(test::short_session()));
  const auto with_delay = [&](double largest_s) {
    write_file(folder / "device.json",
               to_text(Json{{"device", "omega7"},
                            {"delay", {{"provenance", "measured"}, {"largest_s", largest_s}}}}));
  };
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  const std::string file = folder / "device.json";
  options.device_file = file.c_str();
  with_delay(0.002);
  const Opened contact(test::short_session(), options);
  CHECK(contact.info().delay_s == Approx(0.003));
  CHECK(contact.info().hands_N_per_m == Approx(1.0 / 0.0035));
  with_delay(0.010);  // 1 N s/m over 11.5 ms: 87 N/m, and the star has 151
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_REFUSED, options),
             Contains("at most 87 N/m keep six hands below 5 mJ"));
  write_file(folder / "device.json",
             R"({"device": "falcon", "limits": {"stiffness_N_per_m": 100}})");
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_REFUSED, options),
             Contains("too stiff for the device") && Contains("at most 100 N/m"));
  std::snprintf(options.device, sizeof options.device, "omega7");
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_BAD_INPUT, options),
             Contains("is of 'falcon', not of 'omega7'"));
}

TEST_CASE("Hardware in C that nobody has measured counts as 20 ms late and free of friction") {
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(test::short_session()));
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_REFUSED),
             Contains("not measured on this device: 20 ms and no friction count") &&
                 Contains("at most 48.8 N/m keep six hands below 5 mJ") &&
                 Contains("a device file with a measured delay"));
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  options.accept_unstable = 1;
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_USAGE, options),
             Contains("accept_unstable: is not for the device 'omega7'"));
  // What was measured on a simulated device says nothing of motors.
  const std::string file = folder / "device.json";
  options = TPM_HAPTICS_OPTIONS_INIT;
  options.device_file = file.c_str();
  write_file(file, R"({"device": "omega7", "measurement": {"simulated_device": true},
                       "delay": {"provenance": "measured", "largest_s": 0.0}})");
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_REFUSED, options),
             Contains("not measured on this device"));
  // Nor does a file make a device one without motors.
  write_file(file,
             R"({"device": "virtual", "delay": {"provenance": "measured", "largest_s": 0.0}})");
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_BAD_INPUT, options),
             Contains("is 'virtual', without motors") && Contains("--device KIND"));
  std::snprintf(options.device, sizeof options.device, "virtual");
  const Opened named(test::short_session(), options);
  CHECK(named.info().delay_s < 0.020);
}

TEST_CASE("A device that only its file knows, and one of a plugin, are opened in C") {
  const test::TempFolder folder;
  write_file(folder / "session.json", to_text(test::short_session()));
  const std::string kind = GENERATE(as<std::string>{}, "my_robot", "plugin");
  CAPTURE(kind);
  Json device{{"device", kind},
              {"limits",
               {{"force_N", 9.0},
                {"reach_m", 0.08},
                {"stiffness_N_per_m", 2000.0},
                {"damping_N_s_per_m", 10.0},
                {"slew_N_per_s", 1000.0},
                {"least_ramp_in_s", 0.2}}},
              {"delay", {{"provenance", "measured"}, {"largest_s", 0.002}}}};
  const std::string file = folder / "device.json";
  tpm_haptics_options options = TPM_HAPTICS_OPTIONS_INIT;
  options.device_file = file.c_str();
  write_file(file, to_text(device));
  const Opened contact(test::short_session(), options);
  CHECK(contact.info().delay_s == Approx(0.003));
  device["limits"]["stiffness_N_per_m"] = 100.0;
  write_file(file, to_text(device));
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_REFUSED, options),
             Contains("too stiff for the device") && Contains("at most 100 N/m"));
  device["limits"].erase("force_N");
  write_file(file, to_text(device));
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_BAD_INPUT, options),
             Contains("device.json: key /limits: states no force_N"));
  std::snprintf(options.device, sizeof options.device, "gloves");
  CHECK_THAT(refused(folder / "session.json", TPM_HAPTICS_USAGE, options), Contains("gloves"));
}

TEST_CASE("Spheres are drawn where the contact pushes them") {
  const Opened contact(test::network_session("condensed"));
  const tpm_haptics_info info = contact.info();
  CHECK(info.spheres == 60);
  CHECK(info.sphere_radius_m > 0.0);
  CHECK_THAT(info.model, Contains("condensed"));
  std::vector<double> rest(3 * info.spheres), pushed(3 * info.spheres);
  CHECK(tpm_haptics_positions(contact, rest.data(), info.spheres) == TPM_HAPTICS_OK);
  for (int i = 0; i < 1600; ++i) (void)contact.push_back_N(4e-6 * std::max(0, i - 600));
  CHECK(tpm_haptics_positions(contact, pushed.data(), info.spheres) == TPM_HAPTICS_OK);
  const tpm_haptics_state state = contact.state();
  CHECK(state.surface_depth_m == Approx(4e-3).epsilon(0.01));
  std::size_t moved = 0;
  for (std::size_t i = 0; i < info.spheres; ++i) {
    double along = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      along += (pushed[3 * i + k] - rest[3 * i + k]) * info.scene_push[k];
    }
    if (i == info.contact_sphere)
      CHECK(along == Approx(state.surface_depth_m));
    else
      CHECK(along < state.surface_depth_m);
    moved += along > 1e-5 ? 1 : 0;
  }
  CHECK(moved > 3);
  CHECK(tpm_haptics_reset(contact) == TPM_HAPTICS_OK);
  CHECK(tpm_haptics_positions(contact, pushed.data(), info.spheres) == TPM_HAPTICS_OK);
  CHECK(pushed == rest);
}

TEST_CASE("A law file is a contact of its own") {
  const test::TempFolder folder;
  const Json session = Json::parse(read_file(TPM_TEST_SOURCE_DIR "/configs/hil_law.json"));
  Json law = session.at("model").at("law");
  law["law"] = "linear";
  law["parameters"] = {{"k_inf_N_per_m", 60.0}};
  write_file(folder / "law.json", to_text(law));
  const Opened spring(folder / "law.json");
  for (int i = 0; i < 1000; ++i) (void)spring.push_back_N(-1e-3);
  for (int i = 1; i <= 500; ++i) {
    const double depth_m = -1e-3 + 4e-6 * i;
    CHECK(spring.push_back_N(depth_m) ==
          Approx(depth_m > 0.0 ? 60.0 * depth_m : 0.0).margin(1e-12));
  }
}

TEST_CASE("The library shows the calls of its header, versioned, and nothing else") {
  const std::string command =
      std::string("nm -D --defined-only --with-symbol-versions '") + TPM_TEST_HAPTICS + "'";
  std::FILE* pipe = ::popen(command.c_str(), "r");  // NOLINT: the command is this test's
  REQUIRE(pipe != nullptr);
  std::string text;
  char piece[4096];
  while (std::fgets(piece, sizeof piece, pipe) != nullptr) text += piece;
  REQUIRE(::pclose(pipe) == 0);
  std::istringstream lines(text);
  std::string line;
  std::vector<std::string> calls;
  while (std::getline(lines, line)) {
    const std::string name = line.substr(line.rfind(' ') + 1);
    if (name.rfind("TPMKIT_HAPTICS_", 0) == 0) continue;  // the version itself
    const bool later = name.rfind("tpm_haptics_step_at@", 0) == 0;
    CHECK(name.substr(name.find('@')) == (later ? "@@TPMKIT_HAPTICS_2" : "@@TPMKIT_HAPTICS_1"));
    calls.push_back(name.substr(0, name.find('@')));
  }
  const std::string header = read_file(TPM_TEST_SOURCE_DIR "/include/tpmkit/haptics.h");
  std::size_t declared = 0;
  for (std::size_t at = header.find("\nTPM_HAPTICS_API "); at != std::string::npos;
       at = header.find("\nTPM_HAPTICS_API ", at + 1)) {
    ++declared;
  }
  CHECK(calls.size() == declared);
  for (const std::string& call : calls) CHECK_THAT(header, Contains(call + "("));
}

}  // namespace
}  // namespace tpm::haptics
