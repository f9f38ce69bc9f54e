#pragma once
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

namespace tpm {

/// How many threads are meant: all processors that this process may use if none are named.
[[nodiscard]] inline int worker_count(int named) {
  return named > 0 ? named : tbb::info::default_concurrency();
}

/// Does work on so many threads and no more.
template <class Work>
void on_workers(int workers, const Work& work) {
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism,
                                 static_cast<std::size_t>(workers));
  tbb::task_arena(workers).execute(work);
}

}  // namespace tpm
