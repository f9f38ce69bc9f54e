#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "tpm/sweep/block_log.hpp"

namespace tpm::sweep {

/// A part of a sweep's blocks: those whose number leaves `index` when divided by `count`.
struct Shard {
  std::uint64_t index = 0;  ///< from 0
  std::uint64_t count = 1;

  /// Number of its blocks among so many.
  [[nodiscard]] std::uint64_t size(std::uint64_t blocks) const {
    return blocks / count + (index < blocks % count ? 1 : 0);
  }
};

/// Observers of a sweep. Nothing of it changes what it finds.
struct SweepControls {
  int workers = 0;  ///< threads; 0: all processors that this process may use
  Shard shard;
  std::function<void(std::uint64_t blocks_done, std::uint64_t blocks)> progress;
  /// Asked before each cell, by any worker; a block that is not whole then is not stored.
  std::function<bool()> interrupted;
};

/// Course of a sweep: for the sidecar, not for the results.
struct SweepRun {
  std::uint64_t blocks = 0;          ///< of this shard
  std::uint64_t resumed_blocks = 0;  ///< of them, found in the log
  std::uint64_t cells = 0;           ///< computed in this run
  bool interrupted = false;          ///< before all were there
  int workers = 1;
  double seconds = 0.0;      ///< of computing and storing
  double cpu_seconds = 0.0;  ///< of all threads, in the same time
};

/// Computes the blocks that the log does not have yet, and puts them into it. Whatever the number
/// of workers and the order, each block holds the same bits. Throws Error(environment) where the
/// log cannot be written; what was computed before is kept. BlockLog::sync() is the caller's.
[[nodiscard]] SweepRun run_sweep(const Sweep& sweep, BlockLog& log, const SweepControls& controls);

/// File of the log of a sweep whose results go into `output`.
[[nodiscard]] std::filesystem::path log_path(const std::filesystem::path& output);

}  // namespace tpm::sweep
