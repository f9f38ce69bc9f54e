#pragma once
#include <csignal>

namespace tpm::app {

/// While this lives, the first SIGINT or SIGTERM is remembered and a second one kills.
class InterruptWatch {
 public:
  InterruptWatch();
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;
  [[nodiscard]] static bool seen();
  /// Its number; 0 if none was seen.
  [[nodiscard]] static int signal();

 private:
  struct sigaction before_interrupt_ {};
  struct sigaction before_terminate_ {};
};

}  // namespace tpm::app
