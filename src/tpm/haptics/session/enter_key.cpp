#include "tpm/haptics/session/enter_key.hpp"

#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <memory>

namespace tpm::haptics {
namespace {

bool read_a_line(int terminal) {
  pollfd keys{terminal, POLLIN, 0};
  char line[256];
  return ::poll(&keys, 1, 0) > 0 && ::read(terminal, line, sizeof line) > 0;
}

}  // namespace

std::function<void()> watch_enter(int terminal, HilSession& session, SessionRunOptions& options) {
  const bool waits = session.servo.gate && session.servo.gate->confirm;
  const auto confirmed = std::make_shared<std::atomic<bool>>(!waits);
  if (waits) session.servo.gate->confirmed = confirmed;
  const auto markers = std::make_shared<std::atomic<std::uint32_t>>(0);
  options.markers = markers;
  return [terminal, confirmed, markers] {
    if (!read_a_line(terminal)) return;
    if (confirmed->exchange(true)) markers->fetch_add(1);
  };
}

}  // namespace tpm::haptics
