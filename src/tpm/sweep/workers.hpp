#pragma once
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <exception>
#include <mutex>

#include "tpm/base/namespaces.hpp"
#include "tpm/work/parallel.hpp"

namespace tpm::sweep {

/// The first exception of a pipeline's filters, kept until the pipeline is through: one that left a
/// filter would leak what waits between filters (oneTBB 2021).
class FirstFault {
 public:
  /// Does work; what it throws is kept if it is the first.
  template <class Work>
  void guard(const Work& work) noexcept {
    try {
      work();
    } catch (...) {
      const std::scoped_lock hold(lock_);
      if (!fault_) fault_ = std::current_exception();
    }
  }
  [[nodiscard]] bool seen() const {
    const std::scoped_lock hold(lock_);
    return fault_ != nullptr;
  }
  void rethrow() const {
    const std::scoped_lock hold(lock_);
    if (fault_) std::rethrow_exception(fault_);
  }

 private:
  mutable std::mutex lock_;
  std::exception_ptr fault_;
};

/// Number of threads: all processors that this process may use if none are named.
[[nodiscard]] inline int worker_count(int named) {
  return named > 0 ? named : tbb::info::default_concurrency();
}

/// Does work on so many threads and no more. Throws as with_threads.
template <class Work>
void on_workers(int workers, const Work& work) {
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism,
                                 static_cast<std::size_t>(workers));
  with_threads([&] { tbb::task_arena(workers).execute(work); });
}

}  // namespace tpm::sweep
