#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tpm/base/point_set.hpp"

namespace tpm::base {

/// Where a function of the unit cube is asked for its Sobol indices. Each replicate has its own
/// scrambled Sobol points in 2 * inputs dimensions; a point's halves are a row of A and of B, and
/// it gives inputs + 2 cells: A, B, and A with one input after the other taken from B (Saltelli et
/// al. 2010). Replicates are independent, so that their spread tells the error.
struct SensitivityDesign {
  int inputs = 1;                 ///< 1 to 1833
  std::uint64_t points = 256;     ///< of a replicate; a power of two, 2 to 2^31
  std::uint64_t replicates = 32;  ///< 2 or more
  std::uint64_t seed = 0;

  /// replicates * points * (inputs + 2): the cells in the order replicate, point, A B AB_1 ...
  [[nodiscard]] std::uint64_t cells() const;
};

/// The cells of the design as points of `inputs` dimensions. Throws Error on a design out of range.
[[nodiscard]] std::unique_ptr<CubePoints> sensitivity_points(const SensitivityDesign& design);

/// A value and its confidence interval.
struct IndexEstimate {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};

/// Sobol indices of one input: the share of the output's variance that goes when this input is
/// known (first order), and the share that is left when all others are known (total).
struct InputSensitivity {
  IndexEstimate first_order;
  IndexEstimate total;
};

struct SensitivityResult {
  double mean = 0.0;
  double standard_deviation = 0.0;
  double level = 0.95;                   ///< of the intervals
  std::uint64_t left_out = 0;            ///< points of which a cell had no finite output
  std::vector<InputSensitivity> inputs;  ///< no inputs where the output does not vary
};

/// First-order indices by Saltelli et al. (2010), total ones by Jansen (1999), each for every
/// replicate by itself; the value is their mean and the interval Student's t over replicates.
/// `outputs` in the order of the design's cells; a point of which one is not finite is left out.
/// Throws Error if the number of outputs is another, or a replicate has less than two points left.
[[nodiscard]] SensitivityResult sobol_indices(const SensitivityDesign& design,
                                              std::span<const double> outputs, double level = 0.95);

}  // namespace tpm::base
