#pragma once
#include <unistd.h>

#include <utility>

namespace tpm::files {

/// Owns a file descriptor, or none (-1).
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int file) : file_(file) {}
  ~Descriptor() { (void)close(); }
  Descriptor(Descriptor&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(file_, other.file_);
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const noexcept { return file_; }
  /// Tells by 0 what the destructor cannot: that everything was written.
  int close() noexcept {
    const int file = std::exchange(file_, -1);
    return file < 0 ? 0 : ::close(file);
  }

 private:
  int file_ = -1;
};

}  // namespace tpm::files
