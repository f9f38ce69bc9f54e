// Sweeps that are killed: what was computed stands, and the result is that of an undisturbed run.
// TPM_KILLS is the number of moments; by default few enough for every build.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <thread>

#include "temp_folder.hpp"
#include "tpm/base/random.hpp"
#include "tpm/files/file.hpp"

using namespace tpm;
using namespace tpm::base;
using namespace tpm::files;
namespace fs = std::filesystem;

namespace {

const char* const kSweep = R"({"model": "single_contact", "material": {"eta1": "240 kPa s"},
  "indentation": {"kind": "ramp_hold", "rate": "4 mm/s", "hold": "30 s"}, "block": 500,
  "axes": [{"parameter": "depth", "from": "0.1 mm", "to": "10 mm", "count": 300},
           {"parameter": "spacing", "from": "10 mm", "to": "40 mm", "count": 1000}],
  "outputs": ["peak_force", "end_force"]})";

/// Starts `tpm sweep` with its last words in a file.
pid_t start(
    const std::string& sweep, const std::string& output, const std::string& words,
    const std::function<void()>& prepare = [] {}) {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child != 0) return child;
  (void)!freopen("/dev/null", "w", stdout);
  (void)!freopen(words.c_str(), "w", stderr);
  prepare();
  execl(TPM_TEST_PROGRAM, "tpm", "sweep", sweep.c_str(), "-o", output.c_str(), "--workers", "2",
        static_cast<char*>(nullptr));
  _exit(127);
}

int ended(pid_t child) {
  int status = 0;
  (void)waitpid(child, &status, 0);
  return status;
}

int exit_code(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::uintmax_t size_or_none(const std::string& file) {
  std::error_code none;
  const auto size = fs::file_size(file, none);
  return none ? 0 : size;
}

/// Sends the signal once the log has grown by so many bytes, or, where it grows no more because the
/// result is written, 20 ms later: moments of the work, whatever pace the machine has. Returns how
/// the program ended, also where it was faster.
int signalled(pid_t child, int signal, const std::string& log, double growth) {
  using Clock = std::chrono::steady_clock;
  const auto begin = size_or_none(log);
  auto size = begin;
  for (auto grown = Clock::now();;) {
    int status = 0;
    if (waitpid(child, &status, WNOHANG) == child) return status;
    if (const auto now = size_or_none(log); now != size) {
      size = now;
      grown = Clock::now();
    }
    const bool idle = size > begin && Clock::now() - grown > std::chrono::milliseconds(20);
    if (idle || static_cast<double>(size) >= static_cast<double>(begin) + growth) break;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  (void)kill(child, signal);
  return ended(child);
}

/// One line of a program, nothing else.
std::string one_line(const std::string& file) {
  std::string text = read_file(file);
  CHECK(text.find('\n') == text.size() - 1);
  return text;
}

struct Undisturbed {
  test::TempFolder folder;
  std::string sweep = folder / "sweep.json", output = folder / "whole.h5";
  std::string words = folder / "words", bytes;

  Undisturbed() {
    write_file(sweep, kSweep);
    REQUIRE(exit_code(ended(start(sweep, output, words))) == 0);
    bytes = read_file(output);
  }
};

}  // namespace

TEST_CASE("kill -9 and other signals at random moments: resumed to the same bytes") {
  const Undisturbed whole;
  const char* const wished = std::getenv("TPM_KILLS");
  const int kills = wished != nullptr ? std::atoi(wished) : 12;
  const std::string output = whole.folder / "killed.h5";
  Random random(7);
  int killed = 0, kept = 0;
  const std::array signals{SIGKILL, SIGKILL, SIGINT, SIGTERM};
  for (int i = 0; i < kills; ++i) {
    const int signal = signals[random.below(signals.size())];
    const pid_t child = start(whole.sweep, output, whole.folder / "said");
    // The log is about as large as the result. Below 0: while the program starts.
    const double growth =
        static_cast<double>(whole.bytes.size()) * (0.35 * random.uniform() - 0.05);
    std::this_thread::sleep_for(std::chrono::duration<double>(0.02 * random.uniform()));
    const int status = signalled(child, signal, output + ".blocks", growth);
    killed += WIFSIGNALED(status) || exit_code(status) == 128 + signal ? 1 : 0;
    kept += fs::exists(output + ".blocks") ? 1 : 0;
    if (exit_code(status) == 0) fs::remove(output);  // it was done: once more from the start
  }
  CHECK(killed > kills / 2);
  CHECK(kept > 0);
  REQUIRE(exit_code(ended(start(whole.sweep, output, whole.words))) == 0);
  CHECK(read_file(output) == whole.bytes);
  CHECK_FALSE(fs::exists(output + ".blocks"));
}

TEST_CASE("no room for the log, or for the results: one line, and what was computed is kept") {
  const Undisturbed whole;
  const std::string output = whole.folder / "full.h5", log = output + ".blocks";
  // A file may not grow above the limit: what a full disk does, without a disk to fill.
  const auto limited_to = [](rlim_t bytes) {
    return [bytes] {
      (void)::signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{bytes, bytes};
      (void)setrlimit(RLIMIT_FSIZE, &limit);
    };
  };
  const std::string said = whole.folder / "said";
  CHECK(exit_code(ended(start(whole.sweep, output, said, limited_to(1'000'000)))) == 5);
  CHECK(one_line(said).find("cannot write") != std::string::npos);
  CHECK_FALSE(fs::exists(output));
  const auto first = fs::file_size(log);
  CHECK(first > 900'000);
  // The log fits, the result does not.
  const rlim_t less = fs::file_size(whole.output) - 100'000;
  CHECK(exit_code(ended(start(whole.sweep, output, said, limited_to(less)))) == 5);
  CHECK(one_line(said).find("cannot write") != std::string::npos);
  CHECK_FALSE(fs::exists(output));
  CHECK(fs::file_size(log) > 10 * first);
  for (const auto& entry : fs::directory_iterator(whole.folder.path())) {
    CHECK(entry.path().string().find(".part.") == std::string::npos);
  }
  REQUIRE(exit_code(ended(start(whole.sweep, output, whole.words))) == 0);
  CHECK(read_file(output) == whole.bytes);
}

TEST_CASE("a folder that cannot be written, and a result that is a folder: one line") {
  const Undisturbed whole;
  const std::string said = whole.folder / "said";
  fs::create_directory(whole.folder / "folder.h5");
  CHECK(exit_code(ended(start(whole.sweep, whole.folder / "folder.h5", said))) == 5);
  CHECK(one_line(said).find("folder.h5") != std::string::npos);
  CHECK(exit_code(ended(start(whole.sweep, "/proc/nowhere/out.h5", said))) == 5);
  CHECK(one_line(said).find("/proc/nowhere/out.h5") != std::string::npos);
}
