#pragma once
#include <csignal>
#include <vector>

namespace tpm::app {

/// While this lives, the first SIGINT or SIGTERM is recorded and a second one kills. With
/// `motors`, every signal that ends a process (haptics::ending_signals()), and only one kills that
/// comes two seconds after the first: until then the program is stopping them, and must not be
/// killed in the middle of it.
class InterruptWatch {
 public:
  enum class Of { work, motors };
  explicit InterruptWatch(Of of = Of::work);
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;
  [[nodiscard]] static bool seen();
  /// Its number; 0 if none was seen.
  [[nodiscard]] static int signal();
  /// That of a program that was stopped by it, or by one that the guard of forces saw, as shells
  /// expect it.
  [[nodiscard]] static int exit_code();

 private:
  struct Watched {
    int signal = 0;
    struct sigaction before {};
  };
  std::vector<Watched> watched_;
};

}  // namespace tpm::app
