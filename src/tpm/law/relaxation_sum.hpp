#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "tpm/law/relaxation/exponential_sum.hpp"
#include "tpmkit/law.hpp"

namespace tpm::law {

/// The error that the rates of a fractional law are chosen for, ExponentialSum's tolerance.
inline constexpr double kFractionalTolerance = 1e-10;

/// The relaxation function of a law at given parameters, as the time stepper uses it:
///
///     G(t) = constant + sum_j stiffness_j exp(-rate_j t) + dashpot delta(t)
///
/// with the derivatives of the coefficients by the few parameters that they depend on.
struct RelaxationSum {
  double constant = 0.0;
  double dashpot = 0.0;              ///< N s/m
  bool infinite_under_jump = false;  ///< a spring-pot answers a jump with an infinite force
  Eigen::VectorXd rate_per_s;
  Eigen::VectorXd stiffness;
  std::vector<int> rate_parameter;  ///< parameter that is 1/rate_j, or -1 if the rate is fixed
  std::vector<int> by;              ///< parameters that the coefficients depend on
  Eigen::MatrixXd d_stiffness;      ///< size branches x by.size()
  Eigen::VectorXd d_constant;       ///< size by.size()
  Eigen::VectorXd d_dashpot;

  /// G(0), without the dashpot.
  [[nodiscard]] double instant() const { return constant + stiffness.sum(); }
};

/// Relaxation function of a law with branches. The parameters it refers to are those of the
/// parallel form: k_inf (if solid), k_1.., tau_1...
[[nodiscard]] RelaxationSum branch_relaxation(bool solid, int branches,
                                              std::span<const double> parallel);

/// Relaxation function of a fractional law on the fixed rates of a window. What the window does not
/// see is kept too: slow rates as a branch that relaxes only under infinite time, so that
/// `constant` is what remains in the end; for E_alpha the fast rates as two branches with their
/// stiffness and viscosity, so that G(0) is exact; for spring-pots, with infinite instantaneous
/// stiffness, as the dashpot.
/// @param values those of law_parameters: [k_inf], k1, [k2], [tau1], alpha, [beta]
/// Throws Error(bad_input) for a law that is not fractional, or as ExponentialSum.
[[nodiscard]] RelaxationSum fractional_relaxation(Fractional law, std::span<const double> values,
                                                  const ExponentialSum& rates);

}  // namespace tpm::law
