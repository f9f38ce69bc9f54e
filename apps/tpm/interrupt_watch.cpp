#include "interrupt_watch.hpp"

namespace tpm::app {
namespace {

/// What a signal handler may touch has to be of static storage.
volatile std::sig_atomic_t stop_signal = 0;

}  // namespace

InterruptWatch::InterruptWatch() {
  struct sigaction action {};
  action.sa_handler = [](int signal) { stop_signal = signal; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
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
