#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace tpm::fit {

/// The numerical uncertainty of a value that was computed on grids (or at tolerances) that are a
/// constant factor apart.
struct GridConvergenceEstimate {
  double order = 0.0;     ///< observed p; 0 where the values are not monotone
  bool monotone = false;  ///< three values that approach each other
  double expanded = 0.0;  ///< GCI: Fs = 1.25 of the extrapolated error; else 3 of the largest
                          ///< difference
  double u = 0.0;         ///< standard uncertainty, expanded / 2
};

/// Roache's grid convergence index (Perspective: a method for uniform reporting of grid refinement
/// studies, J. Fluids Eng. 116 (1994) 405; ASME V&V 20-2009, 2-4):
///
///     p = ln((f3 - f2) / (f2 - f1)) / ln r,   GCI = 1.25 |f2 - f1| / (r^p - 1),
///
/// from three grids whose differences have one sign and decrease. Everything else (two grids, an
/// oscillation, differences that grow) has 3 times the largest difference. The observed order is
/// taken as at most `largest_order`, which keeps the index from vanishing where it is seen too
/// high.
/// @param values from the finest grid on, two or more
/// @param ratio of neighbouring grids, > 1
/// Throws Error(bad_input) for fewer values, another ratio, or values that are not finite.
[[nodiscard]] GridConvergenceEstimate grid_convergence(const std::vector<double>& values,
                                                       double ratio, double largest_order = 2.0);

/// Deviations of values from their mean over sqrt(n - 1): their squares sum to the variance.
[[nodiscard]] Eigen::RowVectorXd root_of(const std::vector<double>& values);

}  // namespace tpm::fit
