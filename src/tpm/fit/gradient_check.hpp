#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tpm/fit/least_squares.hpp"
#include "tpm/store/json.hpp"

namespace tpm {

enum class GradientVerdict {
  agrees,     ///< with finite differences to the tolerance, or to the differences' own error
  wrong,      ///< the finite differences agree with each other and not with the derivative
  undecided,  ///< the finite differences do not agree with each other: kinks, noise
};

[[nodiscard]] std::string_view gradient_verdict_name(GradientVerdict verdict) noexcept;

/// The derivatives of all residuals by one parameter at one point. Differences are relative to the
/// derivative of the residual in question plus a thousandth of the column's largest.
struct ParameterGradient {
  std::string name;
  double difference = 0.0;  ///< largest over the residuals, analytic from finite, at the best step
  double step = 0.0;        ///< that step, relative to the parameter's size
  double spread = 0.0;  ///< of the finite differences themselves: the best two neighbouring steps
  Eigen::Index residual = 0;  ///< where the difference is largest
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

/// Compares the Jacobian with finite differences at steps of 1e-2 to 1e-7 of each parameter
/// (central, or one-sided of second order where a bound is nearer than the step). As no step suits
/// all, neighbouring steps vote: where two of them agree with each other better than with the
/// Jacobian, the Jacobian is wrong. The random points are a Latin hypercube over the bounds.
/// Throws Error(numerical) if the nominal point or too many random points cannot be evaluated.
[[nodiscard]] GradientCheck check_gradient(const ResidualFunction& function,
                                           std::span<const FitParameter> parameters,
                                           const GradientCheckOptions& options = {});

[[nodiscard]] Json to_json(const GradientCheck& check);
[[nodiscard]] std::string to_terminal_text(const GradientCheck& check);

}  // namespace tpm
