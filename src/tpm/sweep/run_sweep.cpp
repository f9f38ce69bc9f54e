#include "tpm/sweep/run_sweep.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <chrono>
#include <ctime>

#include "tpm/sweep/block_log.hpp"

namespace tpm {
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

/// Numbers of blocks go in at one end, one at a time; workers compute them; blocks come out at the
/// other end, one at a time, in the order in which they were finished. No more are under way than
/// twice the workers, which bounds the memory.
void compute_missing(const Sweep& sweep, int workers, BlockLog& log, SweepRun& run,
                     const SweepControls& controls) {
  MissingBlocks missing(log, controls.shard, sweep.blocks());
  tbb::enumerable_thread_specific<CellRunner> runners([&] { return CellRunner(sweep); });
  const auto number = tbb::make_filter<void, std::uint64_t>(
      tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) -> std::uint64_t {
        if (controls.interrupted && controls.interrupted()) {
          run.interrupted = true;
          flow.stop();
          return 0;
        }
        const auto next = missing.next();
        if (!next) flow.stop();
        return next.value_or(0);
      });
  const auto compute = tbb::make_filter<std::uint64_t, CellBlock>(
      tbb::filter_mode::parallel, [&](std::uint64_t block) { return runners.local().run(block); });
  const auto store = tbb::make_filter<CellBlock, void>(
      tbb::filter_mode::serial_out_of_order, [&](const CellBlock& block) {
        log.append(block);
        run.cells += block.cells();
        if (controls.progress) controls.progress(log.size(), run.blocks);
      });
  tbb::parallel_pipeline(2 * static_cast<std::size_t>(workers), number & compute & store);
}

}  // namespace

SweepRun run_sweep(const Sweep& sweep, const std::filesystem::path& log_file,
                   const SweepControls& controls) {
  SweepRun run;
  run.workers = controls.workers > 0 ? controls.workers : tbb::info::default_concurrency();
  run.blocks = controls.shard.size(sweep.blocks());
  BlockLog log(log_file, sweep, controls.note);
  run.resumed_blocks = log.size();
  if (controls.progress) controls.progress(log.size(), run.blocks);
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = processor_seconds();
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism,
                                 static_cast<std::size_t>(run.workers));
  tbb::task_arena arena(run.workers);
  arena.execute([&] { compute_missing(sweep, run.workers, log, run, controls); });
  log.sync();
  run.cpu_seconds = processor_seconds() - cpu_start;
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

std::filesystem::path log_path(const std::filesystem::path& output) {
  return output.string() + ".blocks";
}

}  // namespace tpm
