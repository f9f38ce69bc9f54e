#pragma once
// Linear stability theory of the step rules on one sphere.
#include <optional>
#include <span>

#include "tpm/base/namespaces.hpp"
#include "tpm/organ/steps/method.hpp"

namespace tpm::accuracy {

/// The element about a depth, linear: force k e - g y under a load, with or without a mass.
struct LinearElement {
  double stiffness_N_per_m = 0.0;  ///< k, tension included
  double relaxing_N_per_m = 0.0;   ///< g
  double relaxation_time_s = 0.0;
  bool depth_imposed = false;
  double mass_kg = 0.0;  ///< 0: none
  double drag_per_s = 0.0;
};

/// @param depth_m at which the tension is taken linear
[[nodiscard]] LinearElement linear_element(const BondElement& p, double depth_m);

/// The longest step at which no part of a step's amplification matrix is larger than 1 (explicit
/// rules: of their stability polynomial at the eigenvalues of the motion), found by bisection on
/// the matrix. None: there is no limit; 0: no step is stable.
[[nodiscard]] std::optional<double> stable_step_s(StepRule rule, const LinearElement& element);

/// Depth under a constant load from rest, from the modes of the motion's matrix.
[[nodiscard]] Eigen::VectorXd linear_motion_m(const LinearElement& element, double load_N,
                                              std::span<const double> times_s);

}  // namespace tpm::accuracy
