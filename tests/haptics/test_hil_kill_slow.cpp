// Sessions that are killed: nothing written is lost.
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "expected_values.hpp"
#include "hil_scenes.hpp"
#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/session/recording.hpp"
#include "tpm/haptics/verify/verify.hpp"

namespace tpm::haptics {

TEST_CASE("kill -9 at random moments: every recording opens and verifies up to the last second") {
  const test::TempFolder folder;
  // What a kill leaves behind is tried, not what a busy machine does to the device's watchdog.
  Json session = test::short_session();
  session["virtual_device"] = {{"least_watchdog", "10 s"}};
  session["limits"] = {{"cycle_timeout", "1 s"}, {"late_cycles", 1000}};  // the machine may stall
  write_file(folder / "session.json", session.dump());
  int verified = 0, written_late = 0;
  Random random(0);
  for (int i = 0; i < 100; ++i) {
    const std::string file = folder / ("r" + std::to_string(i));
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      (void)!freopen("/dev/null", "w", stdout);
      (void)!freopen("/dev/null", "w", stderr);
      execl(TPM_TEST_PROGRAM, "tpm", "hil", "run", (folder / "session.json").c_str(), "--clock",
            "real", "-o", file.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    // A busy machine may take seconds to begin; what is random is the moment after that.
    // The header stands in the file before threads and memory are prepared, rows from the first
    // cycle on.
    std::uintmax_t header = 0;
    for (int wait = 0; wait < 12'000; ++wait) {
      const std::uintmax_t size =
          std::filesystem::exists(file) ? std::filesystem::file_size(file) : 0;
      if (header > 0 && size > header) break;
      if (header == 0) header = size;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(0.65 * random.uniform()));
    const auto alive_until = std::filesystem::file_time_type::clock::now();
    (void)kill(child, SIGKILL);
    int status = 0;
    (void)waitpid(child, &status, 0);
    INFO("session " << i << ", status " << status);
    REQUIRE(std::filesystem::exists(file));
    const HilRecording recording = read_recording(file);
    // A stall of the machine lets the watchdog end a session before it is killed: then it is
    // closed, and whole.
    if (!WIFSIGNALED(status)) CHECK(recording.closed);
    if (recording.closed) continue;
    // What is missing is what the last 50 ms and a stall of the machine can hold.
    const std::chrono::duration<double> unwritten =
        alive_until - std::filesystem::last_write_time(file);
    if (WIFSIGNALED(status) && unwritten.count() >= 1.0) ++written_late;
    if (recording.rows.size() < 2) continue;
    VerifyOptions options;
    options.window_s = 0.0;
    const Verification v = verify(recording, options);
    CHECK_FALSE(v.whole);
    CHECK(v.end_s > 0.0);
    ++verified;
  }
  CHECK(verified >= 30);
  CHECK(written_late <= test::allowed_cost("session.kills_with_a_second_unwritten"));
}

namespace {

/// Status of a session that is sent a signal as it begins; its words stand in the file said<name>.
int ended_by(int signal, const test::TempFolder& folder, const std::string& name) {
  const std::string file = folder / ("r" + name), said = folder / ("said" + name);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    (void)!freopen(said.c_str(), "w", stdout);
    (void)!freopen("/dev/null", "w", stderr);
    execl(TPM_TEST_PROGRAM, "tpm", "hil", "run", (folder / "session.json").c_str(), "--clock",
          "real", "-o", file.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  for (int wait = 0; wait < 12'000 && !std::filesystem::exists(file); ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  (void)kill(child, signal);
  int status = 0;
  (void)waitpid(child, &status, 0);
  return status;
}

}  // namespace

TEST_CASE("Every signal that ends a process lets a session say how it ended, as SIGTERM does") {
  const test::TempFolder folder;
  Json session = test::short_session();
  session["virtual_device"] = {{"least_watchdog", "10 s"}};
  session["limits"] = {{"cycle_timeout", "1 s"}, {"late_cycles", 1000}};
  write_file(folder / "session.json", session.dump());
  for (const int signal : {SIGTERM, SIGUSR1, SIGALRM, SIGIO, SIGPWR, SIGRTMIN}) {
    // A machine that stalls for a second ends a session before its signal does.
    constexpr int kMostTries = 5;
    std::string words = "end: cycle timeout";
    int status = 0;
    for (int i = 0; i < kMostTries && words.find("end: cycle timeout") != std::string::npos; ++i) {
      const std::string name = std::to_string(signal) + "_" + std::to_string(i);
      status = ended_by(signal, folder, name);
      words = read_file(folder / ("said" + name));
    }
    CAPTURE(signal, status, words);
    REQUIRE(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 128 + signal);
    CHECK(words.find("end: signal") != std::string::npos);
    CHECK(words.find("wrote ") != std::string::npos);
  }
}

}  // namespace tpm::haptics
