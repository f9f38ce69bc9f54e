#include "out_of_memory.hpp"

#include <dlfcn.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <string_view>

#include "tpmkit/error.hpp"

namespace tpm::app {
namespace {

std::atomic<int> thrown{0};
std::atomic<pid_t> ends{0};  ///< the process that ends; 0: none yet

}  // namespace

OutOfMemoryIsThrown::OutOfMemoryIsThrown() noexcept {
  ++thrown;
}
OutOfMemoryIsThrown::~OutOfMemoryIsThrown() {
  --thrown;
}

int say_out_of_memory() noexcept {
  static constexpr std::string_view kWords =
      "tpm: out of memory; expected more, or a smaller input\n";
  (void)!::write(STDERR_FILENO, kWords.data(), kWords.size());
  return static_cast<int>(ExitCode::environment);
}

}  // namespace tpm::app

// Sanitizers have functions of their own here.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

void tpm::app::end_when_out_of_memory() noexcept {}

#else

// NOLINTBEGIN(bugprone-reserved-identifier): the C library's own
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}
// NOLINTEND(bugprone-reserved-identifier)

namespace {

using Malloc = void* (*)(std::size_t);
using Calloc = void* (*)(std::size_t, std::size_t);
using Realloc = void* (*)(void*, std::size_t);
using Memalign = void* (*)(std::size_t, std::size_t);

// Those of the C library until main() begins, then the next ones behind the program's: a library
// that was preloaded may have its own (tests/faults).
std::atomic<Malloc> next_malloc{__libc_malloc};
std::atomic<Calloc> next_calloc{__libc_calloc};
std::atomic<Realloc> next_realloc{__libc_realloc};
std::atomic<Memalign> next_memalign{__libc_memalign};

void* block_or_end(void* block, std::size_t size) noexcept {
  if (block != nullptr || size == 0) return block;
  if (tpm::app::thrown == 0 && tpm::app::ends == ::getpid()) {
    ::_exit(tpm::app::say_out_of_memory());
  }
  return nullptr;
}

template <class Function>
void take_next(std::atomic<Function>& function, const char* name) noexcept {
  if (void* found = ::dlsym(RTLD_NEXT, name); found != nullptr) {
    function = reinterpret_cast<Function>(found);
  }
}

}  // namespace

void tpm::app::end_when_out_of_memory() noexcept {
  take_next(next_malloc, "malloc");
  take_next(next_calloc, "calloc");
  take_next(next_realloc, "realloc");
  take_next(next_memalign, "memalign");
  ends = ::getpid();
}

extern "C" {

void* malloc(std::size_t size) noexcept {
  return block_or_end(next_malloc.load(std::memory_order_relaxed)(size), size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  return block_or_end(next_calloc.load(std::memory_order_relaxed)(count, size),
                      count == 0 ? 0 : size);
}

void* realloc(void* block, std::size_t size) noexcept {
  return block_or_end(next_realloc.load(std::memory_order_relaxed)(block, size), size);
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  return block_or_end(next_memalign.load(std::memory_order_relaxed)(alignment, size), size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  return memalign(alignment, size);
}

int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  void* found = memalign(alignment, size);
  if (found == nullptr && size > 0) return ENOMEM;
  *block = found;
  return 0;
}

}  // extern "C"

#endif
