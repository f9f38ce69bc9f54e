#pragma once
#include <memory>

#include "tpm/sweep/run_sweep.hpp"

namespace tpm::sweep {

/// The processes that mpirun has started together. The first one hands out blocks one by one,
/// stores what comes back, and computes blocks itself in between; the others compute. Files are
/// touched by the first alone.
class SweepRanks {
 public:
  /// None if this process was not started by mpirun, or tpm was built without TPM_MPI. All but the
  /// first fall silent: what there is to say, the first says.
  [[nodiscard]] static std::unique_ptr<SweepRanks> of_this_run();
  /// Sends the others home if they still wait.
  ~SweepRanks();  // NOLINT(performance-trivially-destructible): with MPI it is not
  SweepRanks(const SweepRanks&) = delete;
  SweepRanks& operator=(const SweepRanks&) = delete;

  [[nodiscard]] bool first() const { return rank_ == 0; }

  /// As run_sweep, with one worker in each process. Throws on the first process alone.
  [[nodiscard]] SweepRun run(const Sweep& sweep, BlockLog& log, const SweepControls& controls);
  /// Computes what the first one hands out, until it sends home.
  void serve(const Sweep& sweep);

 private:
  SweepRanks(int rank, int size) : rank_(rank), size_(size) {}
  int rank_, size_;
  bool sent_home_ = false;
};

}  // namespace tpm::sweep
