#pragma once
// tpm hil identify, run and verify with --device inverse3 on tpm hil serve, as a user types them:
// programs of their own and the clock.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "temp_folder.hpp"
#include "tpm/files/file.hpp"
#include "tpm/files/json.hpp"
#include "tpm/haptics/inverse/loopback.hpp"
#include "tpm/haptics/inverse/messages.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpmkit/error.hpp"

namespace tpm::test {
using namespace haptics;
using namespace std::chrono_literals;

/// Of a file that may not be there yet, or be empty.
inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// A program beside the test; it ends with it.
class Beside {
 public:
  Beside(const std::vector<std::string>& words, const std::string& output, const std::string& told)
      : child_(begun(words, output, told)) {}
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
  /// The child neither allocates nor locks: another thread may have held a lock.
  static pid_t begun(const std::vector<std::string>& words, const std::string& output,
                     const std::string& told) {
    std::vector<char*> raw;
    for (const std::string& word : words) raw.push_back(const_cast<char*>(word.c_str()));
    raw.push_back(nullptr);
    std::fflush(nullptr);
    const pid_t child = fork();
    if (child != 0) return child;
    (void)std::signal(SIGINT, SIG_DFL);
    constexpr int kWrite = O_WRONLY | O_CREAT | O_TRUNC;
    (void)dup2(open(output.c_str(), kWrite, 0644), STDOUT_FILENO);
    (void)dup2(open(told.c_str(), kWrite, 0644), STDERR_FILENO);
    execv(raw[0], raw.data());
    _exit(127);
  }

  pid_t child_;
};

inline bool until(const std::function<bool()>& met, double seconds) {
  for (int i = 0; i < static_cast<int>(seconds * 200.0) && !met(); ++i) {
    std::this_thread::sleep_for(5ms);
  }
  return met();
}

inline Json shipped(const std::string& name) {
  return files::read_json(std::string(TPM_TEST_SOURCE_DIR "/configs/") + name);
}

/// A device and a hand, behind a tissue that is next to nothing.
inline Json served(int late_periods, bool held) {
  Json json = shipped(held ? "hil_inverse3_held.json" : "hil_inverse3_free.json");
  json["virtual_device"]["delay_periods"] = late_periods;
  return json;
}

/// The session of the client: within the limits of the device, patient with a busy machine.
inline Json rendered() {
  Json json = shipped("hil_inverse3.json");
  json["limits"].update({{"watchdog", "16 ms"}, {"cycle_timeout", "1 s"}, {"late_cycles", 1000}});
  return json;
}

/// tpm hil serve, and the ports that it has told.
struct ServeBeside {
  ServeBeside(const std::string& tpm, const TempFolder& folder, const Json& session) {
    files::write_file(folder / "served.json", session.dump());
    std::filesystem::remove(folder / "served.err");  // of the one before
    program = std::make_unique<Beside>(
        std::vector<std::string>{tpm, "hil", "serve", folder / "served.json", "--port", "0",
                                 "--events-port", "0"},
        folder / "served.txt", folder / "served.err");
    const bool told = until(
        [&] {
          const std::string words = text_of(folder / "served.err");
          return std::sscanf(words.c_str(),
                             "SIMULATED DEVICE at ws://localhost:%d, events at "
                             "ws://localhost:%d",
                             &port, &events_port) == 2;
        },
        120.0);
    if (!told) {
      throw Error(ExitCode::environment, "tpm hil serve", text_of(folder / "served.err"),
                  "the ports that it listens on");
    }
  }
  void add_address(std::vector<std::string>& words) const {
    for (const std::string& word :
         {std::string("--device"), std::string("inverse3"), std::string("--inverse-port"),
          std::to_string(port), std::string("--inverse-events-port"),
          std::to_string(events_port)}) {
      words.push_back(word);
    }
  }
  std::unique_ptr<Beside> program;
  int port = 0, events_port = 0;
};

/// Motion of the hand by a second client, the mover, once a recording has begun: rest, down, and
/// up, until it is told to end.
inline void press(int port, const std::string& recording, const std::atomic<bool>& ending) {
  WebSocketClient mover(port, "/", 5.0, kMostInventoryBytes);
  bool heard = mover.receive(5.0) && mover.send(neutral_message("SIMULATED", "test:mover")) &&
               mover.receive(5.0);
  constexpr double kAir_m = -0.004, kDeep_m = 0.006;
  constexpr int kSteps = 100;
  while (!ending && !std::filesystem::exists(recording)) std::this_thread::sleep_for(5ms);
  for (int i = 3 * kSteps; heard && !ending; i = (i + 1) % (4 * kSteps)) {
    const int up = i < 2 * kSteps ? std::min(i, kSteps) : std::max(3 * kSteps - i, 0);
    const double depth_m = kAir_m + (kDeep_m - kAir_m) * up / kSteps;
    heard = mover.send(
                fmt::format(R"({{"inverse3":[{{"device_id":"SIMULATED","commands":{{)"
                            R"("set_cursor_position":{{"position":{{"x":0,"y":0,"z":{}}}}}}}}}]}})",
                            -depth_m)) &&
            mover.receive(5.0);
    std::this_thread::sleep_for(10ms);
  }
}

/// Answers of the commands of docs/haptics.md.
struct LineRun {
  int identified = -1, ran = -1, verified = -1;  ///< exit codes; -1: not asked
  std::optional<double> found_s, largest_s;
  std::vector<std::string> not_identified;  ///< codes
  double stalled_s = 0.0;
  int begun_again = 0;
  std::size_t cycles = 0;  ///< of the session
  std::string end;         ///< of the session
  double peak_N = 0.0, largest_difference_N = 0.0;
  std::string said;
};

/// Identifies, runs and verifies. @param tpm the program
inline LineRun run_on_the_line(const std::string& tpm, int late_ms) {
  const TempFolder folder;
  LineRun run;
  const auto called = [&](const std::vector<std::string>& words, const char* name) {
    Beside program(words, folder / name, folder / (std::string(name) + ".err"));
    const int status = program.wait_for();
    run.said += fmt::format("{}: {}\n{}{}", name, status,
                            text_of(folder / (std::string(name) + ".err")), text_of(folder / name));
    return status;
  };
  files::write_file(folder / "session.json", rendered().dump());
  const std::string file = folder / "inverse.json", recording = folder / "session.tpmrec";
  {
    const ServeBeside service(tpm, folder, served(late_ms, false));
    std::vector<std::string> words{tpm,          "hil", "identify", folder / "session.json",
                                   "--duration", "8 s", "-o",       file};
    service.add_address(words);
    run.identified = called(words, "identify");
    if (!std::filesystem::exists(file)) return run;
    const Json json = files::parse_json(text_of(file), file);
    for (const Json& remark : json.value("not_identified", Json::array())) {
      run.not_identified.push_back(remark.at("code").get<std::string>());
    }
    run.stalled_s = json.at("measurement").at("stalled_s").get<double>();
    run.begun_again = json.at("measurement").at("begun_again").get<int>();
    if (run.identified != 0) return run;
    run.found_s = json.at("delay").at("mean_s").get<double>();
    run.largest_s = json.at("delay").at("largest_s").get<double>();
  }
  const ServeBeside service(tpm, folder, served(late_ms, true));
  std::vector<std::string> words{tpm,  "hil", "run",    folder / "session.json", "--device-file",
                                 file, "-o",  recording};
  service.add_address(words);
  std::atomic<bool> ending{false};
  std::thread mover([&] {
    try {
      press(service.port, recording, ending);
    } catch (const Error&) {  // nobody presses: the session feels nothing, and says so
    }
  });
  run.ran = called(words, "run");
  ending = true;
  mover.join();
  if (!std::filesystem::exists(recording)) return run;
  const HilRecording read = read_recording(recording);
  run.cycles = read.rows.size();
  run.end = read.closed ? read.closing.at("cause").get<std::string>() : "cut off";
  run.verified = called({tpm, "hil", "verify", recording, "--format", "json"}, "verify");
  if (run.verified != 0) return run;
  const Json answer = files::parse_json(text_of(folder / "verify"), "verify");
  run.peak_N = answer.at("all").at("peak_N").get<double>();
  run.largest_difference_N = answer.at("all").at("max_N").get<double>();
  return run;
}

}  // namespace tpm::test
