#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "tpm/base/namespaces.hpp"

namespace tpm::haptics {

/// When the messages were sent that wait for their state. A service answers each by one state, in
/// their order: a state belongs to the oldest of them. One that was never answered makes the states
/// after it look older by a message, never younger, until it is forgotten.
class UnansweredMessages {
 public:
  void sent(std::int64_t at_ns) noexcept;
  /// When the message was sent that a state answers; empty: nobody has asked for it.
  [[nodiscard]] std::optional<std::int64_t> answered() noexcept;
  /// Nobody waits any more for what was sent before.
  void forget_before(std::int64_t at_ns) noexcept;

 private:
  std::array<std::int64_t, 1024> at_ns_{};
  std::size_t first_ = 0, count_ = 0;
};

inline void UnansweredMessages::sent(std::int64_t at_ns) noexcept {
  if (count_ == at_ns_.size()) (void)answered();
  at_ns_[(first_ + count_++) % at_ns_.size()] = at_ns;
}

inline std::optional<std::int64_t> UnansweredMessages::answered() noexcept {
  if (count_ == 0) return std::nullopt;
  const std::int64_t at_ns = at_ns_[first_];
  first_ = (first_ + 1) % at_ns_.size();
  --count_;
  return at_ns;
}

inline void UnansweredMessages::forget_before(std::int64_t at_ns) noexcept {
  while (count_ > 0 && at_ns_[first_] < at_ns) (void)answered();
}

}  // namespace tpm::haptics
