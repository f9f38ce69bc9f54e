#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tpm/base/namespaces.hpp"
#include "tpm/files/json.hpp"
#include "tpm/fit/likelihood/least_squares.hpp"

namespace tpm::fit {

enum class GradientVerdict {
  agrees,     ///< with finite differences to the tolerance, or to the differences' own error
  wrong,      ///< some residual's derivative is further from the finite difference than that
  undecided,  ///< of most residuals the finite differences say too little: noise, kinks
};

/// The derivatives of all residuals by one parameter at one point; the numbers are those of the
/// residual whose difference is largest for what is known of it. Differences are relative to the
/// derivative plus a thousandth of the column's largest.
struct ParameterGradient {
  std::string name;
  double difference = 0.0;    ///< of the analytic from the finite derivative at the best step
  double step = 0.0;          ///< that step, relative to the parameter's size
  double spread = 0.0;        ///< estimated error of the finite difference there
  Eigen::Index residual = 0;  ///< which residual
  GradientVerdict verdict = GradientVerdict::undecided;
};

struct GradientPoint {
  std::vector<double> natural;  ///< SI
  std::vector<ParameterGradient> parameters;
};

struct GradientCheckOptions {
  int random_points = 3;  ///< besides the nominal one
  std::uint64_t seed = 0;
  double tolerance = 3e-4;  ///< of the relative difference
};

struct GradientCheck {
  GradientCheckOptions options;
  std::vector<GradientPoint> points;  ///< the nominal one first
  int unusable = 0;  ///< random points that could not be evaluated; others were drawn instead
  int wrong = 0, undecided = 0;  ///< columns

  /// No column is wrong, and at least half of them are decided.
  [[nodiscard]] bool passed() const;
};

/// Compares the Jacobian with finite differences at twelve steps of 3e-2 to 1e-7 of each parameter
/// (central, or one-sided of second order where a bound is nearer than the step). As no step suits
/// all, the steps vote, residual by residual: large steps show by how much differences still change
/// (truncation), small ones by how much they scatter (noise), and the step with the least sum of
/// both counts. A derivative is wrong if it differs by more than the tolerance and three times that
/// sum. The random points are a Latin hypercube over the bounds.
/// Throws Error(numerical) if the nominal point or too many random points cannot be evaluated.
[[nodiscard]] GradientCheck check_gradient(const ResidualFunction& function,
                                           std::span<const FitParameter> parameters,
                                           const GradientCheckOptions& options = {});

[[nodiscard]] Json to_json(const GradientCheck& check);
[[nodiscard]] std::string to_terminal_text(const GradientCheck& check);

}  // namespace tpm::fit
