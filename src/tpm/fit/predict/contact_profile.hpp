#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/fit/likelihood/least_squares.hpp"

namespace tpm::fit {

/// Widths of intervals in parts of what derivatives at the estimate say, to each side, in the order
/// of the parameters of the search.
struct IntervalFactors {
  Eigen::VectorXd lower, upper;
};

/// The contact point to walk along, and what the walk starts from.
struct ContactWalk {
  std::span<const FitParameter> parameters;
  std::span<const double> natural;     ///< the minimum, SI
  std::span<const Eigen::Index> free;  ///< parameters off their bounds, contact among them
  Eigen::Index contact = 0;            ///< place in `parameters`
  std::span<const double> quantiles;   ///< of Student's t, one for each of `free`
  Eigen::Index residual_count = 0;
};

/// Intervals by profile likelihood along the contact point. A response has a corner at contact, so
/// that the deviance D bends whenever contact passes a sample, and derivatives at one contact
/// make intervals too narrow if few samples lie before it. At a fixed contact c the other
/// parameters are regular: their minimum D(c), estimate p(c) and variance v(c) follow from
/// Gauss-Newton steps, and the interval of p is the union over c of
///
///     p(c) +- sqrt(v(c) (q^2 - (D(c) - D_min) / s^2)),   s^2 = D_min / (n - p),
///
/// q the quantile of Student's t. The walk goes to both sides in steps of a third of contact's
/// standard error until D(c) - D_min exceeds q^2 s^2, or to a bound.
/// @param residuals whitened; their common standard deviation need not be 1
/// Factors are 1 where the walk cannot be made (no covariance, a residual that is not finite).
[[nodiscard]] IntervalFactors profile_contact(const ResidualFunction& residuals,
                                              const ContactWalk& walk);

}  // namespace tpm::fit
