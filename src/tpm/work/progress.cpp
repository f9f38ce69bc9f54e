#include "tpm/work/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <utility>

namespace tpm::work {
namespace {

std::atomic<bool> line_is_taken = false;  // by the Progress that is shown

bool takes_line() {
  return isatty(STDERR_FILENO) != 0 && !line_is_taken.exchange(true);
}

}  // namespace

Progress::Progress(std::string what, std::size_t total, std::size_t already)
    : what_(std::move(what)),
      total_(total),
      done_(already),
      already_(already),
      start_(std::chrono::steady_clock::now()),
      shown_(takes_line()) {
  draw();
}

Progress::~Progress() {
  if (!shown_) return;
  std::fputs("\r\033[K", stderr);
  line_is_taken = false;
}

void Progress::advance(std::size_t steps) {
  done_ += steps;
  draw();
}

void Progress::draw() const {
  if (!shown_) return;
  if (total_ > 0) {
    fmt::print(stderr, "\r\033[K{}: {} of {}{}", what_, done_, total_, time_left());
  } else {
    fmt::print(stderr, "\r\033[K{}: {}", what_, done_);
  }
  std::fflush(stderr);
}

/// ", 2 min left": as long for the rest as for what was done, step for step.
std::string Progress::time_left() const {
  constexpr double kTooSoon_s = 3.0;
  const double passed_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (passed_s < kTooSoon_s || done_ <= already_ || done_ >= total_) return {};
  const double left_s =
      passed_s * static_cast<double>(total_ - done_) / static_cast<double>(done_ - already_);
  if (left_s < 90.0) return fmt::format(", {:.0f} s left", left_s);
  if (left_s < 5400.0) return fmt::format(", {:.0f} min left", left_s / 60.0);
  return fmt::format(", {:.1f} h left", left_s / 3600.0);
}

}  // namespace tpm::work
