#pragma once
#include <string>
#include <vector>

#include "tpm/base/grid_convergence.hpp"
#include "tpm/base/namespaces.hpp"
#include "tpm/sweep/sweep_reader.hpp"

namespace tpm::sweep {

/// A number of a sweep over ever finer places of one axis.
struct SweepConvergence {
  std::string variable, unit;
  std::string axis;
  std::vector<FixedValue> fixed;  ///< on the other axes
  std::string size_text;       ///< what the size of a place is, such as "spacing" or "count^(-1/3)"
  std::string size_unit;       ///< SI; empty where the size is a formula
  std::vector<double> size;    ///< falling
  std::vector<double> value;   ///< at each size, SI
  std::uint64_t left_out = 0;  ///< places without a finite number
  /// From each three sizes in a row, the coarsest three first.
  std::vector<GridConvergence> threes;

  /// The finest three converge without turning back: only then an order is an order.
  [[nodiscard]] bool monotone() const {
    return threes.back().behaviour == GridConvergence::Behaviour::monotone;
  }
};

/// @param axis none: the last
/// @param size formula of the axis' parameters; empty: the parameter of the axis itself
/// @param held places on the other axes
/// Throws Error(bad_input) if the axis itself is fixed, for curves, axes of samples, sizes that are
/// not above 0 or coincide, and fewer than three places with a number.
[[nodiscard]] SweepConvergence convergence_of(const SweepReader& sweep, const std::string& variable,
                                              const std::optional<std::string>& axis,
                                              const std::string& size, const FixedPlaces& fixed);

}  // namespace tpm::sweep
