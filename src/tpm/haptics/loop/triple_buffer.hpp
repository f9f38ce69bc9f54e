#pragma once
#include <array>
#include <atomic>
#include <cstdint>

namespace tpm::haptics {

/// Hands the newest value from one thread to one other. Neither ever waits, and no value is seen
/// half written: the writer, the reader and the hand-over have a slot each.
template <class T>
class TripleBuffer {
 public:
  void write(const T& value) noexcept {
    slots_[back_] = value;
    back_ = middle_.exchange(back_ | kNew, std::memory_order_acq_rel) & kSlot;
  }
  /// Takes what is new since the last call; false if nothing is.
  bool refresh() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kNew) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kSlot;
    return true;
  }
  /// Value that the last refresh() took.
  [[nodiscard]] const T& latest() const noexcept { return slots_[front_]; }

 private:
  static constexpr std::uint32_t kSlot = 3, kNew = 4;
  std::array<T, 3> slots_{};
  std::uint32_t back_ = 0, front_ = 1;
  std::atomic<std::uint32_t> middle_{2};
};

}  // namespace tpm::haptics
