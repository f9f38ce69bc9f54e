#include "interrupt_watch.hpp"

#include <ctime>

#include "tpm/haptics/device/forces_off_guard.hpp"

namespace tpm::app {
namespace {

// A signal handler may only touch static storage.
volatile std::sig_atomic_t stop_signal = 0, first_s = 0, patience_s = 0;

std::sig_atomic_t seconds_now() {
  timespec now{};
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::sig_atomic_t>(now.tv_sec % 1'000'000);
}

void note_signal(int signal) {
  if (stop_signal == 0) {
    stop_signal = signal;
    first_s = seconds_now();
  } else if (seconds_now() - first_s >= patience_s) {
    haptics::cut_all_forces();
    (void)std::signal(signal, SIG_DFL);
    (void)std::raise(signal);
  }
}

}  // namespace

InterruptWatch::InterruptWatch(Of of) {
  constexpr int kPatience_s = 3;  // whole seconds, of which the first may be short
  patience_s = of == Of::motors ? kPatience_s : 0;
  struct sigaction action {};
  action.sa_handler = note_signal;
  const std::vector<int> signals =
      of == Of::motors ? haptics::ending_signals() : std::vector<int>{SIGINT, SIGTERM};
  watched_.reserve(signals.size());
  for (const int signal : signals) {
    Watched watched;
    watched.signal = signal;
    if (sigaction(signal, nullptr, &watched.before) != 0) continue;
    // Signals that the caller ignores stay ignored: nohup tpm hil run ... Shells let background
    // processes ignore SIGINT and SIGQUIT.
    const bool always = signal == SIGINT || signal == SIGTERM || signal == SIGQUIT;
    if (!always && watched.before.sa_handler != SIG_DFL) continue;
    sigaction(signal, &action, nullptr);
    watched_.push_back(watched);
  }
}

InterruptWatch::~InterruptWatch() {
  for (const Watched& watched : watched_) sigaction(watched.signal, &watched.before, nullptr);
}

bool InterruptWatch::seen() {
  return stop_signal != 0;
}

int InterruptWatch::signal() {
  return stop_signal;
}

int InterruptWatch::exit_code() {
  return 128 + (stop_signal != 0 ? int{stop_signal} : haptics::ForcesOffGuard::last_signal());
}

}  // namespace tpm::app
