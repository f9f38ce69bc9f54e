#include "tpm/core/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace tpm {

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)), total_(total), on_terminal_(isatty(STDERR_FILENO) != 0) {
  draw();
}

Progress::~Progress() {
  if (on_terminal_) std::fputs("\r\033[K", stderr);
}

void Progress::advance(std::size_t steps) {
  done_ += steps;
  draw();
}

void Progress::draw() const {
  if (!on_terminal_) return;
  if (total_ > 0) {
    fmt::print(stderr, "\r\033[K{}: {} of {}", what_, done_, total_);
  } else {
    fmt::print(stderr, "\r\033[K{}: {}", what_, done_);
  }
  std::fflush(stderr);
}

}  // namespace tpm
