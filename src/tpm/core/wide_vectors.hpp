#pragma once
// Loops over numbers side by side, compiled twice: for any processor, and for those with AVX2.

namespace tpm {

#if defined(__x86_64__) && defined(__GNUC__)

namespace detail {

template <class Kernel>
[[gnu::target("avx2"), gnu::flatten]] void run_with_avx2(const Kernel& kernel) {
  kernel();
}

}  // namespace detail

/// Runs a kernel with the widest vectors that this processor has. Both ways give the same bits:
/// nothing is reordered, and products and sums are never contracted (-ffp-contract=off).
/// @param kernel a lambda without calls that cannot be inlined
template <class Kernel>
void run_wide(const Kernel& kernel) {
  if (__builtin_cpu_supports("avx2")) {
    detail::run_with_avx2(kernel);
  } else {
    kernel();
  }
}

#else

template <class Kernel>
void run_wide(const Kernel& kernel) {
  kernel();
}

#endif

}  // namespace tpm
