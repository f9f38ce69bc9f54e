#include "interrupt_watch.hpp"

#include <ctime>

namespace tpm::app {
namespace {

// What a signal handler may touch has to be of static storage.
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
  sigaction(SIGINT, &action, &before_interrupt_);
  sigaction(SIGTERM, &action, &before_terminate_);
}

InterruptWatch::~InterruptWatch() {
  sigaction(SIGINT, &before_interrupt_, nullptr);
  sigaction(SIGTERM, &before_terminate_, nullptr);
}

bool InterruptWatch::seen() {
  return stop_signal != 0;
}

int InterruptWatch::signal() {
  return stop_signal;
}

}  // namespace tpm::app
