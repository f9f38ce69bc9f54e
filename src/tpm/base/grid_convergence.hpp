#pragma once
#include <span>
#include <string>

namespace tpm::base {

/// Convergence of three solutions on ever finer grids (Roache 1994; the procedure of Celik et al.
/// 2008).
struct GridConvergence {
  enum class Behaviour { monotone, oscillating, diverging, exact };
  Behaviour behaviour = Behaviour::exact;
  double order = 0.0;         ///< observed; 0 where diverging or exact
  double extrapolated = 0.0;  ///< at spacing 0; the finest solution where there is no order
  /// Grid convergence index of the finest grid: 1.25 times the estimated error of its solution, in
  /// the solution's unit. Infinite where diverging, 0 where exact.
  double index = 0.0;
};

[[nodiscard]] std::string to_string(GridConvergence::Behaviour behaviour);

/// @param spacing three sizes, > 0 and strictly falling (steps, cells, distances of spheres)
/// @param solution of each
/// Throws Error on other numbers of values, sizes that do not fall, and values that are not finite.
[[nodiscard]] GridConvergence grid_convergence(std::span<const double> spacing,
                                               std::span<const double> solution);

}  // namespace tpm::base
