#pragma once
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "tpm/base/namespaces.hpp"

namespace tpm::haptics {

/// Newest value of one thread for any number of others (a seqlock). The writer never waits. A
/// reader repeats its copy while a write falls into it, so it never sees parts of two values.
template <class T>
class Published {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Published() noexcept { write(T{}); }

  void write(const T& value) noexcept {
    Words words{};
    std::memcpy(words.data(), &value, sizeof value);
    ++version_;  // odd: a write is under way
    for (std::size_t i = 0; i < words.size(); ++i) words_[i] = words[i];
    ++version_;
  }
  [[nodiscard]] T read() const noexcept {
    Words words{};
    std::uint64_t before = 0;
    do {
      before = version_;
      for (std::size_t i = 0; i < words.size(); ++i) words[i] = words_[i];
    } while (before % 2 != 0 || version_ != before);
    T value{};
    std::memcpy(static_cast<void*>(&value), words.data(), sizeof value);
    return value;
  }

 private:
  using Words = std::array<std::uint64_t, (sizeof(T) + 7) / 8>;

  // Sequentially consistent throughout: a reader's copy lies between its two looks at the version.
  std::array<std::atomic<std::uint64_t>, std::tuple_size_v<Words>> words_{};
  std::atomic<std::uint64_t> version_{0};
};

}  // namespace tpm::haptics
