#pragma once
#include "tpm/accuracy/verify/certified_problems.hpp"
#include "tpm/fit/fit.hpp"

namespace tpm::accuracy {

/// Unbounded parameters b1, b2, ... on a linear scale.
[[nodiscard]] std::vector<FitParameter> certified_parameters(std::span<const double> start);

/// The residuals of a problem with their derivatives.
class CertifiedResiduals final : public ResidualFunction {
 public:
  /// @param problem must live as long as this
  /// @param flaw the curve is wrong by this share
  explicit CertifiedResiduals(const CertifiedProblem& problem, double flaw = 0.0)
      : problem_(problem), scale_(1.0 + flaw) {}
  [[nodiscard]] Eigen::Index residual_count() const override {
    return static_cast<Eigen::Index>(problem_.x.size());
  }
  [[nodiscard]] bool evaluate(std::span<const double> b, Eigen::VectorXd& residual,
                              RowMatrix* jacobian) const override;

 private:
  const CertifiedProblem& problem_;
  double scale_;
};

/// A noise scale that is estimated from the residuals, as NIST's standard deviations are.
[[nodiscard]] Threshold certified_threshold(const CertifiedProblem& problem);

/// Solved from one start by the search that every fit uses.
/// @param profiles whether profile intervals are found
[[nodiscard]] FitResult fit_certified(const CertifiedProblem& problem,
                                      const std::vector<double>& start, double flaw = 0.0,
                                      bool profiles = false);

}  // namespace tpm::accuracy
