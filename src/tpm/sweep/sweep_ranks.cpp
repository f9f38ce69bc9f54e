#include "tpm/sweep/sweep_ranks.hpp"

#ifdef TPM_MPI
#include <mpi.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "tpm/sweep/block_log.hpp"
#include "tpmkit/error.hpp"
#endif

namespace tpm::sweep {

#ifndef TPM_MPI

std::unique_ptr<SweepRanks> SweepRanks::of_this_run() {
  return nullptr;
}
SweepRanks::~SweepRanks() = default;
SweepRun SweepRanks::run(const Sweep& sweep, BlockLog& log, const SweepControls& controls) {
  return run_sweep(sweep, log, controls);
}
void SweepRanks::serve(const Sweep& /*sweep*/) {}

#else

namespace {

enum Tag : int { kBlockTag = 1, kResultTag, kFailureTag };
constexpr std::uint64_t kGoHome = ~std::uint64_t{0};
/// Blocks that a process has at a time: while one is under way the next lies ready.
constexpr int kAhead = 2;

void send_number(std::uint64_t number, int to) {
  MPI_Send(&number, 1, MPI_UINT64_T, to, kBlockTag, MPI_COMM_WORLD);
}

/// A message of bytes from any process.
struct Message {
  std::string bytes;
  int from = 0, tag = 0;
};

Message receive() {
  MPI_Status status;
  MPI_Probe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &status);
  int size = 0;
  MPI_Get_count(&status, MPI_BYTE, &size);
  Message message{std::string(static_cast<std::size_t>(size), '\0'), status.MPI_SOURCE,
                  status.MPI_TAG};
  MPI_Recv(message.bytes.data(), size, MPI_BYTE, message.from, message.tag, MPI_COMM_WORLD,
           MPI_STATUS_IGNORE);
  return message;
}

/// The first process' part: who has how many blocks, and what is left.
class Distribution {
 public:
  Distribution(const Sweep& sweep, BlockLog& log, const SweepControls& controls, int size,
               SweepRun& run)
      : sweep_(sweep), log_(log), controls_(controls), size_(size), run_(run), own_(sweep) {}

  void work() {
    for (int ahead = 0; ahead < kAhead; ++ahead) {
      for (int rank = 1; rank < size_; ++rank) hand_out(rank);
    }
    for (;;) {
      int waiting = 0;
      MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &waiting, MPI_STATUS_IGNORE);
      if (waiting != 0) {
        take();
      } else if (const auto block = next()) {
        if (const auto own = own_.run_unless(*block, controls_.interrupted)) {
          store(log_record(*own), *block);
        } else {
          run_.interrupted = true;
        }
      } else if (under_way_ > 0) {
        take();
      } else {
        return;
      }
    }
  }

  /// Waits for what is still computed, and lets it be.
  void drain() {
    for (; under_way_ > 0; --under_way_) static_cast<void>(receive());
  }

 private:
  [[nodiscard]] std::optional<std::uint64_t> next() {
    if (controls_.interrupted && controls_.interrupted()) run_.interrupted = true;
    if (run_.interrupted) return std::nullopt;
    while (next_ < sweep_.blocks() && log_.has(next_)) ++next_;
    if (next_ == sweep_.blocks()) return std::nullopt;
    return next_++;
  }

  void hand_out(int rank) {
    const auto block = next();
    if (!block) return;
    send_number(*block, rank);
    ++under_way_;
  }

  void take() {
    const Message message = receive();
    --under_way_;
    if (message.tag == kFailureTag) throw Error(ExitCode::environment, "sweep", message.bytes);
    std::uint64_t number = 0;
    std::memcpy(&number, message.bytes.data(), sizeof number);
    hand_out(message.from);  // first: the other process must not wait for the disk
    store(std::string_view(message.bytes).substr(sizeof number), number);
  }

  void store(std::string_view record, std::uint64_t number) {
    log_.append(number, record);
    run_.cells += std::min(sweep_.block_cells, sweep_.cells() - number * sweep_.block_cells);
    if (controls_.progress) controls_.progress(log_.size(), run_.blocks);
  }

  const Sweep& sweep_;
  BlockLog& log_;
  const SweepControls& controls_;
  int size_;
  SweepRun& run_;
  CellRunner own_;
  std::uint64_t next_ = 0;
  int under_way_ = 0;
};

}  // namespace

std::unique_ptr<SweepRanks> SweepRanks::of_this_run() {
  if (std::getenv("OMPI_COMM_WORLD_SIZE") == nullptr && std::getenv("PMI_SIZE") == nullptr) {
    return nullptr;
  }
  int rank = 0, size = 1;
  MPI_Init(nullptr, nullptr);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  if (rank > 0 && (std::freopen("/dev/null", "w", stderr) == nullptr ||
                   std::freopen("/dev/null", "w", stdout) == nullptr)) {
    MPI_Abort(MPI_COMM_WORLD, static_cast<int>(ExitCode::environment));
  }
  return std::unique_ptr<SweepRanks>(new SweepRanks(rank, size));
}

SweepRanks::~SweepRanks() {
  if (first() && !sent_home_) {
    for (int rank = 1; rank < size_; ++rank) send_number(kGoHome, rank);
  }
  MPI_Finalize();
}

SweepRun SweepRanks::run(const Sweep& sweep, BlockLog& log, const SweepControls& controls) {
  SweepRun run;
  run.workers = size_;
  run.blocks = sweep.blocks();
  run.resumed_blocks = log.size();
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  Distribution distribution(sweep, log, controls, size_, run);
  try {
    distribution.work();
  } catch (...) {
    distribution.drain();
    throw;
  }
  for (int rank = 1; rank < size_; ++rank) send_number(kGoHome, rank);
  sent_home_ = true;
  run.cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

void SweepRanks::serve(const Sweep& sweep) {
  std::optional<CellRunner> runner;
  for (;;) {
    std::uint64_t number = 0;
    MPI_Recv(&number, 1, MPI_UINT64_T, 0, kBlockTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    if (number == kGoHome) return;
    std::string bytes(reinterpret_cast<const char*>(&number), sizeof number);
    int tag = kResultTag;
    try {
      if (!runner) runner.emplace(sweep);
      bytes += log_record(runner->run(number));
    } catch (const std::exception& error) {
      bytes = error.what();
      tag = kFailureTag;
    }
    MPI_Send(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, 0, tag, MPI_COMM_WORLD);
  }
}

#endif

}  // namespace tpm::sweep
