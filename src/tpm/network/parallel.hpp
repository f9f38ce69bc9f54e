#pragma once
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace tpm::organ {

/// Calls f(i) for i = 0, 1, ... below `count`, on as many threads as there are processors or as the
/// caller's arena allows. No call may depend on another: results are the same for any number of
/// threads. A thread that waits here takes up no other work, so that what belongs to the caller's
/// thread stays its own.
template <class Index, class Function>
void for_each_in_parallel(Index count, const Function& f) {
  tbb::this_task_arena::isolate([&] { tbb::parallel_for(Index{0}, count, f); });
}

}  // namespace tpm::organ
