#pragma once
#include <Eigen/Core>
#include <complex>
#include <span>
#include <vector>

#include "tpm/law/operational_stiffness.hpp"
#include "tpmkit/law.hpp"

namespace tpm::law {

/// A number and its derivatives by all parameters of a law.
struct SlopedNumber {
  double value = 0.0;
  Eigen::VectorXd by;
};

/// Responses of a law without tension to a step, with their derivatives by its parameters.
class StepResponse {
 public:
  /// @param values all of law_parameters(spec), in range (LawModel::require_in_range); they must
  /// outlive this
  StepResponse(const LawSpec& spec, std::span<const double> values);

  /// G(t), N/m (or Pa), at t > 0 after a unit step of V(u). The contour sum of laplace_contour.hpp
  /// over the law's operational stiffness; the error is some 1e-13 of |s L[G](s)| at s = 1/t.
  /// (relaxation_stiffness has the closed forms, without slopes.)
  /// Throws Error(bad_input) for a time that is not above 0 and finite.
  [[nodiscard]] SlopedNumber relaxation(double t_s) const;
  /// The creep compliance J(t), m/N (or 1/Pa): V(u) at t > 0 under a unit load from t = 0 on. The
  /// integral of J(t - s) dG(s) from 0 to t is 1.
  /// Throws Error(bad_input) also for a law without any stiffness.
  [[nodiscard]] SlopedNumber creep(double t_s) const;
  /// J just after the step, of a fractional law: 0 where a spring-pot stands in no spring's series.
  [[nodiscard]] SlopedNumber creep_at_once() const;

 private:
  /// 1/s times the transform to be inverted, and its derivative by the operational stiffness.
  template <class Function>
  [[nodiscard]] SlopedNumber inverse_over_s(double t_s, const Function& f) const;

  struct Node {
    std::complex<double> log_s;
    std::complex<double> weight_over_s;
    OperationalStiffness::Powers powers;  ///< at s; of fractional laws
  };

  LawSpec spec_;
  Eigen::Index count_;
  OperationalStiffness stiffness_;
  std::vector<Node> nodes_;
};

}  // namespace tpm::law
