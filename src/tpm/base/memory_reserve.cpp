#include "tpm/base/memory_reserve.hpp"

#include <cstdlib>
#include <new>

namespace tpm::base {
namespace {

thread_local MemoryReserve* innermost = nullptr;

}  // namespace

MemoryReserve::MemoryReserve(std::size_t bytes) : bytes_(std::malloc(bytes)), outer_(innermost) {
  if (bytes_ == nullptr) throw std::bad_alloc();
  innermost = this;
  // Stays: where a thread has no reserve it does what happens without a handler.
  std::set_new_handler(&MemoryReserve::give_back);
}

MemoryReserve::~MemoryReserve() {
  innermost = outer_;
  std::free(bytes_);
}

void MemoryReserve::require_unused() const {
  if (bytes_ == nullptr) throw std::bad_alloc();
}

/// The handler of a request that cannot be met: it is tried again if this returns.
void MemoryReserve::give_back() {
  for (MemoryReserve* reserve = innermost; reserve != nullptr; reserve = reserve->outer_) {
    if (reserve->bytes_ == nullptr) continue;
    std::free(reserve->bytes_);
    reserve->bytes_ = nullptr;
    return;
  }
  throw std::bad_alloc();
}

}  // namespace tpm::base
