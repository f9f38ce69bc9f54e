#pragma once
// Loops over numbers side by side, compiled three times: for any processor, for those with AVX2,
// and for those with AVX-512.

namespace tpm::base {

#if defined(__x86_64__) && defined(__GNUC__)

namespace detail {

template <class Kernel>
[[gnu::target("avx2"), gnu::flatten]] void run_with_avx2(const Kernel& kernel) {
  kernel();
}

#ifdef __clang__
#define TPM_AVX512 "avx512f,avx512vl,avx512dq"
#else
#define TPM_AVX512 "avx512f,avx512vl,avx512dq,prefer-vector-width=512"
#endif

template <class Kernel>
[[gnu::target(TPM_AVX512), gnu::flatten]] void run_with_avx512(const Kernel& kernel) {
  kernel();
}

#undef TPM_AVX512

}  // namespace detail

/// Runs a kernel with the widest vectors that this processor has. All ways give the same bits:
/// nothing is reordered, and products and sums are never contracted (-ffp-contract=off).
/// @param kernel a lambda without calls that cannot be inlined
template <class Kernel>
void run_wide(const Kernel& kernel) {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq")) {
    detail::run_with_avx512(kernel);
  } else if (__builtin_cpu_supports("avx2")) {
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

}  // namespace tpm::base
