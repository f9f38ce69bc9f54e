#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/sweep/sweep_reader.hpp"

namespace tpm::sweep {

/// A parameter of a cell.
struct CellParameter {
  std::string name, target;  ///< as in results, and as the model knows it ("/material/E1")
  std::string unit;          ///< SI
  double value = 0.0;
};

/// A cell that few are better than.
struct BestCell {
  std::vector<std::uint64_t> places;      ///< on all axes; 0 on one that is summed over
  double value = 0.0;                     ///< of the output
  std::vector<CellParameter> parameters;  ///< but those of the axis that is summed over
};

/// The cells with the least values of an output, the least first; of equal ones the first cell.
/// Cells that are not done are none, with `over` also those with one that is not done along it.
/// @param over an axis that is summed over: several experiments, one misfit
/// Throws Error(bad_input) if there is no such cell.
[[nodiscard]] std::vector<BestCell> best_cells(const SweepReader& sweep, const std::string& output,
                                               std::size_t count,
                                               const std::optional<std::string>& over);

/// A configuration of tpm fit that goes on from a cell: its parameters become the starts of those
/// that it estimates, and nothing else is started from. Throws Error(bad_input) if the cell has
/// none of them, says different things of one, or lies outside its bounds.
/// @param where of `fit`, for messages
[[nodiscard]] Json fit_from_cell(Json fit, const BestCell& cell, std::string_view where);

}  // namespace tpm::sweep
