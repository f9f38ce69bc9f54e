// tpm hil run --device inverse3 on tpm hil serve, as a user would: two programs and the clock.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hil_scenes.hpp"
#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/inverse/loopback.hpp"
#include "tpm/haptics/inverse/messages.hpp"

namespace tpm::haptics {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using namespace std::chrono_literals;
using files::Json;

/// Of a file that may not be there yet, or be empty.
std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// A program beside the test; it ends with it.
class Beside {
 public:
  Beside(const std::vector<std::string>& words, const std::string& output, const std::string& told)
      : child_((std::fflush(nullptr), fork())) {
    if (child_ != 0) return;
    (void)std::signal(SIGINT, SIG_DFL);
    (void)!freopen(output.c_str(), "w", stdout);
    (void)!freopen(told.c_str(), "w", stderr);
    std::vector<char*> raw;
    for (const std::string& word : words) raw.push_back(const_cast<char*>(word.c_str()));
    raw.push_back(nullptr);
    execv(raw[0], raw.data());
    _exit(127);
  }
  Beside(const Beside&) = delete;
  Beside& operator=(const Beside&) = delete;
  ~Beside() {
    if (child_ <= 0) return;
    (void)kill(child_, SIGINT);
    (void)wait_for();
  }
  int wait_for() {
    int status = 0;
    (void)waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t child_;
};

bool until(const std::function<bool()>& met, double seconds) {
  for (int i = 0; i < static_cast<int>(seconds * 200.0) && !met(); ++i) {
    std::this_thread::sleep_for(5ms);
  }
  return met();
}

/// A device and a hand, behind a tissue that is next to nothing.
Json served(int late_periods, bool held) {
  Json json = test::short_session();
  for (const char* modulus : {"E1", "E2", "Eprime"}) {
    json["model"]["scene"]["material"][modulus] = "10 Pa";
  }
  json["model"]["scene"]["material"]["eta1"] = "20 Pa s";
  json["virtual_device"] = {{"delay_periods", late_periods}, {"arm_set_point", "-4 mm"}};
  if (!held) {
    json["virtual_device"].update(
        {{"arm_mass_kg", 0.0}, {"arm_damping_N_s_per_m", 0.0}, {"arm_stiffness", "0 N/m"}});
  }
  return json;
}

/// What the client renders: within the limits of the device, patient with a busy machine.
Json rendered() {
  Json json = test::short_session();
  for (const char* modulus : {"E1", "E2", "Eprime"}) {
    json["model"]["scene"]["material"][modulus] = "4 kPa";
  }
  json["model"]["scene"]["material"]["eta1"] = "8e3 Pa s";
  json.erase("creep");
  json["limits"] = {
      {"force", "3 N"}, {"watchdog", "16 ms"}, {"cycle_timeout", "1 s"}, {"late_cycles", 1000}};
  return json;
}

/// tpm hil serve, and the port that it has told.
struct ServeBeside {
  ServeBeside(const test::TempFolder& folder, const Json& session) {
    files::write_file(folder / "served.json", session.dump());
    std::filesystem::remove(folder / "served.err");  // of the one before
    program = std::make_unique<Beside>(
        std::vector<std::string>{TPM_TEST_PROGRAM, "hil", "serve", folder / "served.json", "--port",
                                 "0", "--events-port", "0"},
        folder / "served.txt", folder / "served.err");
    REQUIRE(until(
        [&] {
          const std::string told = text_of(folder / "served.err");
          return std::sscanf(told.c_str(),
                             "SIMULATED DEVICE at ws://localhost:%d, events at "
                             "ws://localhost:%d",
                             &port, &events_port) == 2;
        },
        30.0));
  }
  [[nodiscard]] std::vector<std::string> address() const {
    return {"--device",
            "inverse3",
            "--inverse-port",
            std::to_string(port),
            "--inverse-events-port",
            std::to_string(events_port)};
  }
  std::unique_ptr<Beside> program;
  int port = 0, events_port = 0;
};

/// What a second client, the mover, does with the hand: down for two seconds, and up.
void press(WebSocketClient& mover, double seconds) {
  const auto go_to = [&mover](double depth_m) {
    REQUIRE(mover.send(
        fmt::format(R"({{"inverse3":[{{"device_id":"SIMULATED","commands":{{)"
                    R"("set_cursor_position":{{"position":{{"x":0,"y":0,"z":{}}}}}}}}}]}})",
                    -depth_m)));
    REQUIRE(mover.receive(5.0));
    std::this_thread::sleep_for(10ms);
  };
  constexpr double kAir_m = -0.004, kDeep_m = 0.006;
  constexpr int kSteps = 100;
  for (int i = 0; i <= kSteps; ++i) go_to(kAir_m + (kDeep_m - kAir_m) * i / kSteps);
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  for (int i = kSteps; i >= 0; --i) go_to(kAir_m + (kDeep_m - kAir_m) * i / kSteps);
}

struct LineRun {
  bool whole = false;
  double found_s = 0.0, at_start_s = 0.0, peak_N = 0.0, largest_difference_N = 0.0;
  std::string said;
};

/// Identifies, runs and verifies, by the commands of docs/haptics.md.
LineRun run_on_the_line(int late_ms) {
  const test::TempFolder folder;
  LineRun run;
  const auto called = [&](const std::vector<std::string>& words, const char* name) {
    Beside program(words, folder / name, folder / (std::string(name) + ".err"));
    const int status = program.wait_for();
    run.said +=
        fmt::format("{}: {}\n{}", name, status, text_of(folder / (std::string(name) + ".err")));
    return status == 0;
  };
  files::write_file(folder / "session.json", rendered().dump());
  const std::string file = folder / "inverse.json", recording = folder / "session.tpmrec";
  {
    const ServeBeside service(folder, served(late_ms, false));
    std::vector<std::string> words{TPM_TEST_PROGRAM, "hil", "identify", folder / "session.json",
                                   "--duration",     "8 s", "-o",       file};
    for (const std::string& word : service.address()) words.push_back(word);
    if (!called(words, "identify")) return run;
    const Json json = files::parse_json(text_of(file), file);
    if (!json.contains("delay")) return run;
    run.found_s = json.at("delay").at("mean_s").get<double>();
  }
  const ServeBeside service(folder, served(late_ms, true));
  std::vector<std::string> words{TPM_TEST_PROGRAM, "hil", "run", folder / "session.json",
                                 "--device-file",  file,  "-o",  recording};
  for (const std::string& word : service.address()) words.push_back(word);
  Beside session(words, folder / "run", folder / "run.err");
  WebSocketClient mover(service.port, "/", 5.0, kMostInventoryBytes);
  REQUIRE(mover.receive(5.0));
  REQUIRE(mover.send(neutral_message("SIMULATED", "test:mover")));
  REQUIRE(mover.receive(5.0));
  if (until([&] { return std::filesystem::exists(recording); }, 20.0)) {
    std::this_thread::sleep_for(1s);  // the conditions of the start take half of it
    press(mover, 1.0);
  }
  const int status = session.wait_for();
  run.said +=
      fmt::format("run: {}\n{}{}", status, text_of(folder / "run.err"), text_of(folder / "run"));
  if (status != 0) return run;
  if (!called({TPM_TEST_PROGRAM, "hil", "verify", recording, "--format", "json"}, "verify")) {
    return run;
  }
  const Json verified = files::parse_json(text_of(folder / "verify"), "verify");
  run.said += verified.dump(1);
  run.peak_N = verified.at("all").at("peak_N").get<double>();
  run.largest_difference_N = verified.at("all").at("max_N").get<double>();
  run.whole = true;
  return run;
}

TEST_CASE("By the command line and the clock, delays put in are found and a session is verified") {
  for (const int late_ms : {0, 2, 5}) {
    CAPTURE(late_ms);
    // Other programs can stall either side: what ended early is tried again.
    constexpr int kMostTries = 10;
    LineRun run;
    for (int tries = 0; tries < kMostTries && !run.whole; ++tries) run = run_on_the_line(late_ms);
    INFO(run.said);
    REQUIRE(run.whole);
    // Found beyond it is the way of the messages and of the loop that serves: at most a period
    // each.
    CHECK(run.found_s >= 1e-3 * late_ms);
    CHECK(run.found_s <= 1e-3 * late_ms + 2e-3);
    CHECK(run.peak_N > 0.05);
    CHECK(run.largest_difference_N < 0.01 * run.peak_N);
    fmt::print("{} ms put in: {:.2f} ms found, largest difference {:.3g} % of {:.3g} N\n", late_ms,
               1e3 * run.found_s, 1e2 * run.largest_difference_N / run.peak_N, run.peak_N);
  }
}

}  // namespace
}  // namespace tpm::haptics
