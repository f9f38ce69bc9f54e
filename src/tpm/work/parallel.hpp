#pragma once
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <stdexcept>
#include <system_error>

#include "tpmkit/error.hpp"

namespace tpm::work {

/// Does work for which oneTBB may start threads. Throws Error(environment) if the system has none
/// left; oneTBB says so by a std::runtime_error, which nothing of ours throws.
template <class Work>
void with_threads(const Work& work) {
  try {
    work();
  } catch (const Error&) {
    throw;
  } catch (const std::system_error&) {  // of files
    throw;
  } catch (const std::runtime_error& error) {
    throw Error(ExitCode::environment, "threads", error.what(),
                "a system that can start one more thread");
  }
}

/// Calls f(i) for i = 0, 1, ... below `count`, on as many threads as there are processors or as the
/// caller's arena allows. No call may depend on another: results are the same for any number of
/// threads. A thread that waits here takes up no other work, so that what belongs to the caller's
/// thread stays its own. Throws as with_threads, and what f throws.
template <class Index, class Function>
void for_each_in_parallel(Index count, const Function& f) {
  with_threads(
      [&] { tbb::this_task_arena::isolate([&] { tbb::parallel_for(Index{0}, count, f); }); });
}

}  // namespace tpm::work
