#pragma once

namespace tpm::app {

/// From here on, memory that cannot be had ends this process at once, in one line and with exit
/// code 5: libraries do not survive it (Eigen frees twice, others follow null pointers), and files
/// that are not whole have no name (Replacement). Child processes go on and handle it themselves.
void end_when_out_of_memory() noexcept;

/// While this lives, requests that fail are answered as usual, with std::bad_alloc: a device has to
/// be stopped first.
class OutOfMemoryIsThrown {
 public:
  OutOfMemoryIsThrown() noexcept;
  ~OutOfMemoryIsThrown();
  OutOfMemoryIsThrown(const OutOfMemoryIsThrown&) = delete;
  OutOfMemoryIsThrown& operator=(const OutOfMemoryIsThrown&) = delete;
};

/// Says so without asking for memory, and returns the exit code.
int say_out_of_memory() noexcept;

}  // namespace tpm::app
