#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#endif

namespace tpm::contact {

/// Numbers too small for full precision count as 0 while this lives: what decays towards 0 would
/// otherwise slow the processor down a hundredfold.
class FlushDenormals {
 public:
#if defined(__x86_64__) && defined(__GNUC__)
  FlushDenormals() noexcept : before_(_mm_getcsr()) {
    _mm_setcsr(before_ | kFlush);
  }
  ~FlushDenormals() {
    _mm_setcsr(before_);
  }

 private:
  static constexpr unsigned kFlush = 0x8040;  // results to zero, operands are zero
  unsigned before_;
#else
  FlushDenormals() noexcept {}
  ~FlushDenormals() {}
#endif

 public:
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;
};

}  // namespace tpm::contact
