#pragma once
// Whether a sanitizer is linked in. Tests of the preset `check` are compiled without one and linked
// with a library that has it, so that macros of the compiler do not tell.

extern "C" {
// NOLINTBEGIN(bugprone-reserved-identifier): names of the sanitizers' own
void __asan_init() __attribute__((weak));
void __tsan_init() __attribute__((weak));
// NOLINTEND(bugprone-reserved-identifier)
}

namespace tpm::test {

/// A sanitizer takes addresses of its own, so limits of memory mean nothing to it.
inline bool has_sanitizer() {
  return &__asan_init != nullptr || &__tsan_init != nullptr;
}

}  // namespace tpm::test
