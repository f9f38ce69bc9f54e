#include "tpm/sweep/run_sweep.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>

#include "tpm/sweep/workers.hpp"

namespace tpm::sweep {
namespace {

double processor_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// The blocks of a shard that a log does not have, one after the other.
class MissingBlocks {
 public:
  MissingBlocks(const BlockLog& log, const Shard& shard, std::uint64_t blocks)
      : log_(log), shard_(shard), blocks_(blocks), next_(shard.index) {}

  [[nodiscard]] std::optional<std::uint64_t> next() {
    while (next_ < blocks_ && log_.has(next_)) next_ += shard_.count;
    if (next_ >= blocks_) return std::nullopt;
    const std::uint64_t block = next_;
    next_ += shard_.count;
    return block;
  }

 private:
  const BlockLog& log_;
  Shard shard_;
  std::uint64_t blocks_, next_;
};

/// A computed block on its way into the log; one without cells was interrupted.
struct Finished {
  std::uint64_t block = 0, cells = 0;
  std::string record;
};

/// Numbers of blocks go in at one end, one at a time; workers compute them; blocks come out at the
/// other end, one at a time, in the order in which they were finished. No more are under way than
/// twice the workers, which bounds the memory.
void compute_missing(const Sweep& sweep, int workers, BlockLog& log, SweepRun& run,
                     const SweepControls& controls) {
  MissingBlocks missing(log, controls.shard, sweep.blocks());
  tbb::enumerable_thread_specific<CellRunner> runners([&] { return CellRunner(sweep); });
  FirstFault fault;
  std::atomic<bool> stopped = false;
  const auto interrupted = [&] {
    if (controls.interrupted && !stopped && controls.interrupted()) stopped = true;
    return stopped.load();
  };
  const auto number = tbb::make_filter<void, std::uint64_t>(
      tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) -> std::uint64_t {
        const auto next = stopped || fault.seen() ? std::nullopt : missing.next();
        if (!next) flow.stop();
        return next.value_or(0);
      });
  const auto compute =
      tbb::make_filter<std::uint64_t, Finished>(tbb::filter_mode::parallel, [&](std::uint64_t b) {
        Finished finished;
        fault.guard([&] {
          const auto block = runners.local().run_unless(b, interrupted);
          if (block) finished = {b, block->cells(), log_record(*block)};
        });
        return finished;
      });
  const auto store = tbb::make_filter<Finished, void>(
      tbb::filter_mode::serial_out_of_order, [&](const Finished& finished) {
        if (finished.cells == 0 || fault.seen()) return;
        fault.guard([&] {
          log.append(finished.block, finished.record);
          run.cells += finished.cells;
          if (controls.progress) controls.progress(log.size(), run.blocks);
        });
      });
  tbb::parallel_pipeline(2 * static_cast<std::size_t>(workers), number & compute & store);
  fault.rethrow();
  run.interrupted = stopped;
}

}  // namespace

SweepRun run_sweep(const Sweep& sweep, BlockLog& log, const SweepControls& controls) {
  SweepRun run;
  run.workers = worker_count(controls.workers);
  run.blocks = controls.shard.size(sweep.blocks());
  run.resumed_blocks = log.size();
  log.require_room(run.blocks - std::min(run.blocks, log.size()));
  if (controls.progress) controls.progress(log.size(), run.blocks);
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = processor_seconds();
  on_workers(run.workers, [&] { compute_missing(sweep, run.workers, log, run, controls); });
  run.cpu_seconds = processor_seconds() - cpu_start;
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

std::filesystem::path log_path(const std::filesystem::path& output) {
  return output.string() + ".blocks";
}

}  // namespace tpm::sweep
