#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tpm/sweep/block_log.hpp"

namespace tpm::sweep {

/// Numbers of cells by how they ended.
struct CellTally {
  std::uint64_t done = 0, skipped = 0, failed = 0;
  std::vector<std::string> reasons;  ///< why, in the order of the cells; at most kMostReasons
};
inline constexpr std::size_t kMostReasons = 1000;

/// Writes the results of a whole sweep as one HDF5 file (docs/sweep.md): each variable as an array
/// over the axes, with dimension scales, so that any reader of netCDF 4 names them. Two blocks for
/// each worker are held in memory. Equal logs give equal bytes, whatever the order of their blocks.
/// Throws Error(environment) if there is no room, Error(bad_input) if a block is missing or
/// damaged.
/// @param logs that hold all blocks together
/// @param workers threads; 0: all processors
CellTally write_sweep(const Sweep& sweep, const std::vector<const BlockLog*>& logs,
                      const std::filesystem::path& file, int workers = 0);

/// Above this many numbers no CSV is written.
inline constexpr std::uint64_t kMostCsvNumbers = 2'000'000;

/// One line per cell: parameters, status, reason, counts, variables. False if that would be too
/// many numbers to be of use as text; the file is then not written.
bool write_sweep_csv(const Sweep& sweep, const std::vector<const BlockLog*>& logs,
                     const std::filesystem::path& file);

/// The fingerprint of the sweep whose results a file holds; empty if it holds none.
[[nodiscard]] std::string fingerprint_of(const std::filesystem::path& file);

}  // namespace tpm::sweep
