#pragma once
// Counts what the whole program takes from the heap and gives back: by new, by C's functions, and
// so by Eigen, which calls malloc. To be included by one source of a program.
#include <Eigen/Core>  // before the definitions: clang's declares posix_memalign otherwise
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <new>

namespace tpm::testing {

inline std::atomic<long> heap_calls{0};

/// Calls of the heap since this was made, in all threads.
class HeapWatch {
 public:
  [[nodiscard]] long calls() const { return heap_calls - start_; }

 private:
  long start_ = heap_calls;
};

}  // namespace tpm::testing

// NOLINTBEGIN: replaced for the whole program, which is the point
extern "C" {

// What the C library does itself, and where AddressSanitizer is, what that does instead.
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
[[gnu::weak]] void* __interceptor_malloc(std::size_t);
[[gnu::weak]] void* __interceptor_calloc(std::size_t, std::size_t);
[[gnu::weak]] void* __interceptor_realloc(void*, std::size_t);
[[gnu::weak]] void* __interceptor_memalign(std::size_t, std::size_t);
[[gnu::weak]] void __interceptor_free(void*);

void* malloc(std::size_t size) noexcept {
  ++tpm::testing::heap_calls;
  return __interceptor_malloc ? __interceptor_malloc(size) : __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  ++tpm::testing::heap_calls;
  return __interceptor_calloc ? __interceptor_calloc(count, size) : __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  ++tpm::testing::heap_calls;
  return __interceptor_realloc ? __interceptor_realloc(memory, size) : __libc_realloc(memory, size);
}
void* memalign(std::size_t line, std::size_t size) noexcept {
  ++tpm::testing::heap_calls;
  return __interceptor_memalign ? __interceptor_memalign(line, size) : __libc_memalign(line, size);
}
void* aligned_alloc(std::size_t line, std::size_t size) noexcept {
  return memalign(line, size);
}
int posix_memalign(void** memory, std::size_t line, std::size_t size) noexcept {
  *memory = memalign(line, size);
  return *memory ? 0 : ENOMEM;
}
void free(void* memory) noexcept {
  if (memory) ++tpm::testing::heap_calls;
  __interceptor_free ? __interceptor_free(memory) : __libc_free(memory);
}

// What the dynamic linker keeps is no leak. AddressSanitizer knows that of calls that come straight
// from it, not by malloc() above; oneTBB and plugins load libraries.
const char* __lsan_default_suppressions() {
  return "leak:ld-linux\n";
}
}

// AddressSanitizer's would not come by malloc. Not inlined, or g++ sees malloc meet delete.
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (void* const memory = malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t& /*how*/) noexcept {
  return malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/) noexcept {
  free(memory);
}
// NOLINTEND
