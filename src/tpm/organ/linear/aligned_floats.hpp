#pragma once
#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace tpm::organ {

/// Memory that starts with a line of the processor's cache, so that its vectors may be loaded.
template <class T>
struct LineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kLine{64};

  LineAllocator() = default;
  template <class U>
  // NOLINTNEXTLINE(google-explicit-constructor): allocators convert
  LineAllocator(const LineAllocator<U>& /*other*/) noexcept {}

  [[nodiscard]] T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new(count * sizeof(T), kLine));
  }
  void deallocate(T* memory, std::size_t /*count*/) noexcept { ::operator delete(memory, kLine); }
  template <class U>
  bool operator==(const LineAllocator<U>& /*other*/) const noexcept {
    return true;
  }
};

using AlignedFloats = std::vector<float, LineAllocator<float>>;
using AlignedWords = std::vector<std::uint32_t, LineAllocator<std::uint32_t>>;

}  // namespace tpm::organ
