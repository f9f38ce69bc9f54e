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

/// G(t) of a law, N/m (or Pa): the response at t > 0 to a unit step of V(u), without tension.
/// The contour sum of laplace_contour.hpp over the law's operational stiffness; the error is some
/// 1e-13 of |s L[G](s)| at s = 1/t. (relaxation_stiffness has the closed forms, without slopes.)
/// @param values all of law_parameters(spec)
/// Throws Error(bad_input) for values out of range, or a time that is not above 0 and finite.
[[nodiscard]] SlopedNumber law_relaxation(const LawSpec& spec, std::span<const double> values,
                                          double t_s);

/// The creep compliance J(t), m/N (or 1/Pa): V(u) at t > 0 under a unit load from t = 0 on, without
/// tension. The integral of J(t - s) dG(s) from 0 to t is 1. Computed as law_relaxation.
/// Throws Error(bad_input) also for a law without any stiffness.
[[nodiscard]] SlopedNumber law_creep(const LawSpec& spec, std::span<const double> values,
                                     double t_s);

/// law_relaxation and law_creep at many times: what does not depend on the time is computed once.
class StepResponse {
 public:
  /// @param values all of law_parameters(spec), in range (LawModel::require_in_range); they must
  /// outlive this
  StepResponse(const LawSpec& spec, std::span<const double> values);

  /// Throws Error(bad_input) as the functions above, for the time and for a law without stiffness.
  [[nodiscard]] SlopedNumber relaxation(double t_s) const;
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
