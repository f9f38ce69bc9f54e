#pragma once
#include <atomic>
#include <csignal>
#include <cstddef>
#include <vector>

#include "tpmkit/device.hpp"

namespace tpm::haptics {

/// Switches the forces of a device off however the process ends. Lives from before a device is
/// prepared until it was stopped; the loops of a session hold one each, so that every front end has
/// it. While the first of them lives:
///
///   - a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, so std::terminate too, SIGSYS,
///     SIGXCPU): HapticDevice::cut_forces() of every guarded device, then the action that stood
///     before;
///   - std::exit and std::quick_exit: the same;
///   - SIGHUP, SIGQUIT, SIGINT, SIGTERM and others that end a process, those of real time too, and
///     that nobody else handles: the loop sees ended_by_signal() and stops in order; when the last
///     guard goes, the signal is raised again, so that the process ends as it would have;
///   - SIGTSTP (Ctrl-Z), SIGTTIN and SIGTTOU that nobody else handles: the same. The session is
///     over, and the process stops then, with forces off;
///   - SIGPIPE and SIGXFSZ that nobody else handles are ignored: the write fails instead, which is
///     an exception.
///
/// SIGKILL, SIGSTOP and a loss of power leave no time; the watchdog of the device switches off
/// then. cut_forces() of a library is called from a signal handler, which libraries do not promise
/// to allow: if it does not come back within two seconds, the process ends all the same.
class ForcesOffGuard {
 public:
  /// @param device must live as long as this
  explicit ForcesOffGuard(HapticDevice& device);
  ~ForcesOffGuard();
  ForcesOffGuard(const ForcesOffGuard&) = delete;
  ForcesOffGuard& operator=(const ForcesOffGuard&) = delete;

  /// A signal that ends the process came while a guard lived.
  [[nodiscard]] static bool ended_by_signal() noexcept;
  /// The last one that came while a guard lived; 0 if none did.
  [[nodiscard]] static int last_signal() noexcept;

 private:
  std::atomic<HapticDevice*>* slot_ = nullptr;
};

/// While it lives, signals of this thread are handled on a stack of their own: a thread that
/// crashes because its stack is full has no other. One thread makes and destroys it.
class SignalStack {
 public:
  SignalStack();
  ~SignalStack();
  SignalStack(const SignalStack&) = delete;
  SignalStack& operator=(const SignalStack&) = delete;

 private:
  std::vector<std::byte> room_;
  stack_t before_{};
};

/// Signals that end a process and at which the loop of a guarded device stops in order. A program
/// that takes them itself lives on to say how the session ended.
[[nodiscard]] std::vector<int> ending_signals();

/// cut_forces() of every guarded device. For whoever ends the process without exit handlers.
void cut_all_forces() noexcept;

}  // namespace tpm::haptics
