// However a process ends, forces go off: each end is tried in a child process, on the stand-in
// library, whose log is read afterwards.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <functional>
#include <memory>

#include "shaken_contact.hpp"
#include "temp_folder.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/files/file.hpp"
#include "tpm/haptics/device/force_dimension.hpp"
#include "tpm/haptics/device/forces_off_guard.hpp"
#include "tpm/haptics/loop/empty_space.hpp"
#include "tpmkit/error.hpp"
#include "tpmkit/servo_loop.hpp"

namespace tpm::haptics {
namespace {

using End = std::function<void()>;

/// Ends the process, in the way that the test says, while forces are on.
class EndingModel final : public EmptySpace {
 public:
  explicit EndingModel(const End& end) : end_(end) {}
  ContactAnswer step(const ToolPose&) noexcept override {
    if (++steps_ == 100) end_();
    return {};
  }

 private:
  const End& end_;
  int steps_ = 0;
};

struct Ended {
  int status = 0;
  int forces_off = 0, forces_on = 0;  ///< how often the device saw that
  int stopped_by = 0;                 ///< a signal, after which it was told to go on; 0: none
  int forces_off_then = 0;
};

constexpr int kEndedInOrder = 98;

/// How often the device saw it.
int times_seen(const std::string& file, const std::string& what) {
  std::ifstream events(file);
  std::string name;
  int times = 0;
  for (long long number = 0; events >> name >> number;) times += name == what ? 1 : 0;
  return times;
}

/// What the library of the device saw of a process that ended so.
Ended ended_by(const End& end, bool real_time, bool survives = false) {
  const test::TempFolder folder;
  write_file(folder / "script", "watchdog_by_clock 0\nevents " + (folder / "events") + "\n");
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    // As in a program of its own: what Catch2 does with signals is none of its business.
    for (int signal = 1; signal < 32; ++signal) (void)std::signal(signal, SIG_DFL);
    const rlimit no_core{0, 0};
    (void)::setrlimit(RLIMIT_CORE, &no_core);
    (void)setenv("TPM_STAND_IN_SCRIPT", (folder / "script").c_str(), 1);
    const auto device = std::make_shared<ForceDimension>(TPM_STAND_IN_DHD);
    (void)device->open();
    device->prepare({});
    ServoSettings settings;
    settings.phase_ends = {3000};
    settings.most_late = 1001;
    settings.most_missed = 1'000'000;
    const auto model = std::make_shared<EndingModel>(end);
    const RecordSink sink = [](const ServoRecord&) {};
    RealTimeOptions options;
    options.cycle_timeout_s = 5.0;
    const ServoOutcome outcome = real_time
                                     ? run_in_real_time(device, model, settings, sink, options)
                                     : run_in_virtual_time(*device, *model, settings, sink);
    if (outcome.cause == StopCause::signal) ::_exit(kEndedInOrder);
    ::_exit(survives && outcome.cause == StopCause::finished ? 0 : 99);
  }
  Ended result;
  REQUIRE(::waitpid(child, &result.status, WUNTRACED) == child);
  if (WIFSTOPPED(result.status)) {
    result.stopped_by = WSTOPSIG(result.status);
    result.forces_off_then = times_seen(folder / "events", "forces_off");
    (void)::kill(child, SIGCONT);
    REQUIRE(::waitpid(child, &result.status, 0) == child);
  }
  result.forces_on = times_seen(folder / "events", "thread_of_forces_on");
  result.forces_off = times_seen(folder / "events", "forces_off");
  CHECK(result.forces_on == 1);
  return result;
}

bool ended_by_signal(const Ended& ended, int signal) {
  return WIFSIGNALED(ended.status) && WTERMSIG(ended.status) == signal;
}

TEST_CASE("A process that crashes switches the forces off first") {
  const bool real_time = GENERATE(false, true);
  CAPTURE(real_time);
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS, SIGXCPU}) {
    CAPTURE(signal);
    const Ended ended = ended_by([signal] { (void)::raise(signal); }, real_time);
    CHECK(ended_by_signal(ended, signal));
    CHECK(ended.forces_off == 1);
  }
}

TEST_CASE("A process that ends itself in the middle of a session switches the forces off first") {
  const std::vector<std::pair<const char*, End>> ends{
      {"exit", [] { std::exit(3); }},
      {"quick_exit", [] { std::quick_exit(3); }},
      {"abort", [] { std::abort(); }},
      {"terminate", [] { std::terminate(); }},
      {"throws where nothing may", [] { throw Error(ExitCode::numerical, "plugin", "throws"); }}};
  for (const auto& [name, end] : ends) {
    CAPTURE(name);
    const Ended ended = ended_by(end, false);
    CHECK((WIFSIGNALED(ended.status) || WEXITSTATUS(ended.status) == 3));
    CHECK(ended.forces_off >= 1);
  }
}

TEST_CASE("A signal that ends a process lets the session stop in order first") {
  const bool real_time = GENERATE(false, true);
  CAPTURE(real_time);
  for (const int signal :
       {SIGHUP, SIGQUIT, SIGTERM, SIGINT, SIGUSR1, SIGALRM, SIGRTMIN, SIGRTMIN + 5, SIGRTMAX}) {
    CAPTURE(signal);
    const Ended ended = ended_by([signal] { (void)::kill(::getpid(), signal); }, real_time);
    CHECK(ended_by_signal(ended, signal));
    CHECK(ended.forces_off >= 1);
  }
}

TEST_CASE("A signal that stops a process ends the session first, and forces are off then") {
  const bool real_time = GENERATE(false, true);
  CAPTURE(real_time);
  for (const int signal : {SIGTSTP, SIGTTIN, SIGTTOU}) {
    CAPTURE(signal);
    const auto stop = [signal] {
      (void)::setpgid(0, 0);  // such signals stop no group of processes that nobody looks after
      (void)::kill(::getpid(), signal);
    };
    const Ended ended = ended_by(stop, real_time);
    CHECK(ended.stopped_by == signal);
    CHECK(ended.forces_off_then >= 1);
    CHECK(WIFEXITED(ended.status));
    CHECK(WEXITSTATUS(ended.status) == kEndedInOrder);
  }
}

TEST_CASE("A write that fails is no signal while forces are on") {
  for (const int signal : {SIGPIPE, SIGXFSZ}) {
    CAPTURE(signal);
    const Ended ended = ended_by([signal] { (void)::raise(signal); }, false, true);
    CHECK(WIFEXITED(ended.status));
    CHECK(WEXITSTATUS(ended.status) == 0);
    CHECK(ended.forces_off == 1);
  }
}

TEST_CASE("When no device is guarded any more, signals do what they did before") {
  struct sigaction before {};
  sigaction(SIGSEGV, nullptr, &before);
  {
    class Quiet final : public test::Puppet {
     public:
      void cut_forces() noexcept override { ++cut; }
      int cut = 0;
    } quiet;
    const ForcesOffGuard guard(quiet);
    {
      const ForcesOffGuard again(quiet);
      struct sigaction during {};
      sigaction(SIGSEGV, nullptr, &during);
      CHECK(during.sa_handler != before.sa_handler);
    }
    cut_all_forces();
    CHECK(quiet.cut == 1);
    CHECK_FALSE(ForcesOffGuard::ended_by_signal());
  }
  struct sigaction after {};
  sigaction(SIGSEGV, nullptr, &after);
  CHECK(after.sa_handler == before.sa_handler);
}

}  // namespace
}  // namespace tpm::haptics
