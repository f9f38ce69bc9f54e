#include "tpm/haptics/device/forces_off_guard.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <mutex>

#include "tpmkit/error.hpp"

namespace tpm::haptics {
namespace {

constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, SIGSYS, SIGXCPU};
constexpr std::array kEnds{SIGHUP,  SIGQUIT,   SIGINT,  SIGTERM, SIGUSR1, SIGUSR2,
                           SIGALRM, SIGVTALRM, SIGPROF, SIGPOLL, SIGPWR,  SIGSTKFLT};
/// A stopped process sends no command, and nobody watches its device.
constexpr std::array kStops{SIGTSTP, SIGTTIN, SIGTTOU};
constexpr std::array kFailedWrites{SIGPIPE, SIGXFSZ};
constexpr std::size_t kSignals = 65;

// Read by a signal handler.
std::array<std::atomic<HapticDevice*>, 32> guarded;
std::atomic<int> end_signal{0}, last_signal_seen{0};
std::array<struct sigaction, kSignals> before;
std::array<std::atomic<bool>, kSignals> taken;
static_assert(std::atomic<HapticDevice*>::is_always_lock_free);

std::mutex living_mutex;
int living = 0;

void end_in_any_case() noexcept {
  constexpr unsigned kPatience_s = 2;
  struct sigaction standard {};
  standard.sa_handler = SIG_DFL;
  sigaction(SIGALRM, &standard, nullptr);
  ::alarm(kPatience_s);
}

void give_back(int signal) noexcept {
  const auto at = static_cast<std::size_t>(signal);
  if (taken[at].exchange(false)) sigaction(signal, &before[at], nullptr);
}

extern "C" void tpm_cut_forces_and_end(int signal) {
  end_in_any_case();
  give_back(signal);
  cut_all_forces();
  (void)::raise(signal);
}

extern "C" void tpm_remember_end(int signal) {
  end_signal = signal;
  last_signal_seen = signal;
}

/// True if a call that it interrupts goes on. A terminal sends SIGTTIN and SIGTTOU again for each
/// call that does, so that it would never come back.
bool restarts(int signal) noexcept {
  return std::find(kStops.begin(), kStops.end(), signal) == kStops.end();
}

void take(int signal, void (*handler)(int), bool also_from_others) noexcept {
  const auto at = static_cast<std::size_t>(signal);
  if (sigaction(signal, nullptr, &before[at]) != 0) return;
  const bool nobody = (before[at].sa_flags & SA_SIGINFO) == 0 && before[at].sa_handler == SIG_DFL;
  if (!nobody && !also_from_others) return;
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = handler == tpm_cut_forces_and_end ? SA_NODEFER | SA_ONSTACK
                    : restarts(signal)                ? SA_RESTART
                                                      : 0;
  sigemptyset(&action.sa_mask);
  taken[at] = sigaction(signal, &action, nullptr) == 0;
}

void take_all() {
  // Anew for each session: what was registered last runs first, before a library of a device that
  // was loaded meanwhile takes itself down.
  (void)std::atexit(cut_all_forces);
  (void)std::at_quick_exit(cut_all_forces);
  end_signal = 0;
  for (const int signal : kCrashes) take(signal, tpm_cut_forces_and_end, true);
  for (const int signal : ending_signals()) take(signal, tpm_remember_end, false);
  for (const int signal : kStops) take(signal, tpm_remember_end, false);
  for (const int signal : kFailedWrites) take(signal, SIG_IGN, false);
}

void give_all_back() noexcept {
  for (int signal = 1; signal <= SIGRTMAX; ++signal) give_back(signal);
}

}  // namespace

std::vector<int> ending_signals() {
  std::vector<int> signals(kEnds.begin(), kEnds.end());
  // The C library keeps the first of them for itself: their numbers are known at run time only.
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) signals.push_back(signal);
  return signals;
}

void cut_all_forces() noexcept {
  for (std::atomic<HapticDevice*>& slot : guarded) {
    // Each once: a crash in cut_forces() must not come here again.
    if (HapticDevice* device = slot.exchange(nullptr)) device->cut_forces();
  }
}

SignalStack::SignalStack() {
  constexpr std::size_t kRoom = 1U << 16U;  // a handler calls into the library of the device
  room_.resize(kRoom);
  stack_t stack{};
  stack.ss_sp = room_.data();
  stack.ss_size = room_.size();
  (void)::sigaltstack(&stack, &before_);
}

SignalStack::~SignalStack() {
  (void)::sigaltstack(&before_, nullptr);
}

ForcesOffGuard::ForcesOffGuard(HapticDevice& device) {
  const std::lock_guard<std::mutex> lock(living_mutex);
  if (living++ == 0) take_all();
  for (std::atomic<HapticDevice*>& slot : guarded) {
    HapticDevice* none = nullptr;
    if (!slot.compare_exchange_strong(none, &device)) continue;
    slot_ = &slot;
    return;
  }
  if (--living == 0) give_all_back();
  throw Error(ExitCode::environment, "haptic devices", "too many are in use at a time",
              "at most 32 in a process");
}

ForcesOffGuard::~ForcesOffGuard() {
  *slot_ = nullptr;
  int signal = 0;
  {
    const std::lock_guard<std::mutex> lock(living_mutex);
    if (--living > 0) return;
    give_all_back();
    signal = end_signal.exchange(0);
  }
  if (signal != 0) (void)::raise(signal);
}

bool ForcesOffGuard::ended_by_signal() noexcept {
  return end_signal != 0;
}

int ForcesOffGuard::last_signal() noexcept {
  return last_signal_seen;
}

}  // namespace tpm::haptics
