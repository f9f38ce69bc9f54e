#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tpm/sweep/sweep.hpp"

namespace tpm::sweep {

/// Outcome of a cell. One that is done has finite values only.
enum class CellStatus : std::uint8_t { done, skipped, failed };

/// The model of a cell that ran on none.
inline constexpr std::uint8_t kNoModel = 255;

/// The results of a stretch of cells: the unit of work and of storage.
struct CellBlock {
  std::uint64_t number = 0;
  std::vector<CellStatus> status;
  std::vector<std::uint16_t> reason;   ///< of each cell: a place in `reasons`, from 1; 0: none
  std::vector<double> error_estimate;  ///< NaN where nothing was found
  /// A place in SweepModel::models(), or kNoModel where nothing was found; empty if there is no
  /// choice.
  std::vector<std::uint8_t> model;
  std::vector<std::vector<std::int64_t>> counts;  ///< of each counted operation
  std::vector<std::vector<double>> values;        ///< of each variable, cell by cell; NaN as above
  std::vector<std::string> reasons;

  [[nodiscard]] std::size_t cells() const { return status.size(); }
};

/// A block of a sweep before anything is found.
[[nodiscard]] CellBlock empty_block(const Sweep& sweep, std::uint64_t number);

/// Computes blocks, for one worker.
class CellRunner {
 public:
  /// @param sweep has to outlive the runner
  explicit CellRunner(const Sweep& sweep);
  ~CellRunner();
  CellRunner(const CellRunner&) = delete;
  CellRunner& operator=(const CellRunner&) = delete;

  /// A cell without an answer is recorded with its reason. What it holds depends on the sweep and
  /// the block's number alone.
  [[nodiscard]] CellBlock run(std::uint64_t block);
  /// The same; none as soon as `interrupted`, asked before each cell, says so.
  [[nodiscard]] std::optional<CellBlock> run_unless(std::uint64_t block,
                                                    const std::function<bool()>& interrupted);

 private:
  struct Expressions;
  void run_cell(std::size_t cell, CellBlock& block);
  void require_finite() const;
  void set_aside(std::size_t cell, CellStatus status, const std::string& reason, CellBlock& block);

  const Sweep& sweep_;
  std::unique_ptr<CellModel> model_;
  std::unique_ptr<Expressions> expressions_;  ///< none if the sweep has no conditions and formulas
  std::vector<std::uint64_t> places_;
  std::vector<double> swept_, values_;
  std::vector<std::int64_t> counts_;
};

}  // namespace tpm::sweep
